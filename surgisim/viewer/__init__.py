"""What a run found, to look at and to touch, in a browser."""
