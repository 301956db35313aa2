"""Physical parameters from motion: what is compared, in which rounds, and what a clip can tell."""
