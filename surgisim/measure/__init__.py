"""One metric per file: the folder is the catalogue. `groups/` asks them of a whole run."""
