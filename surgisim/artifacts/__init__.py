"""One file per kind of file on disk. Imports numpy and the standard library only."""
