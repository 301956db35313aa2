"""One file per table of numbers: which metrics are asked of which part of a run."""
