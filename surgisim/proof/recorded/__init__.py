"""What others measured, made into recordings that the tool reads."""
