"""New manipulations of the body, and pictures of them."""
