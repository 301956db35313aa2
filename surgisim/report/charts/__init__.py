"""One figure per file, each a function that returns a picture's address."""
