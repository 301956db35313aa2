"""One law per file; the file's name is the law's name everywhere."""
