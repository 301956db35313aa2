"""What a recording shows: masks, missing tissue, depth, motion. One file per backend."""
