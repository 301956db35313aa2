"""What the instrument holds, from when to when, and where it carries it."""
