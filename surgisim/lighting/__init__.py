"""Light of the lamp that rides on the endoscope: what a moved surface looks like under it."""
