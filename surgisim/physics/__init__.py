"""The laws of tissue, one file each in `terms/`, and how several become one kernel."""
