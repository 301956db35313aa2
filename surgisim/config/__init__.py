"""The science's choices: one file per top-level key of config.yaml."""
