"""Two solvers on one manipulation: the invented scenes, each solver's run of them, and what is left between."""
