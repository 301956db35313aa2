"""The scene as 3D Gaussians: how they are made, seen and kept in shape."""
