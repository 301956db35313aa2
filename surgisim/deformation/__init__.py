"""The field that moves the canonical Gaussians: feature planes and a small head."""
