"""What no named law explains, modelled without a name: which forms pay, their character, and whether they predict."""
