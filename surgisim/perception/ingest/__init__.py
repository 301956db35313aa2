"""From whatever holds a recording to frames, camera and what came with them."""
