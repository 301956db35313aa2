"""What physics was left out, on one page that an engineer understands in a minute."""
