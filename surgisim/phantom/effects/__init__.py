"""Physics that a recording may conceal, one file an effect."""
