"""The recording without the instrument. A backend is one file here with a function `fill`; its file name is its name.

fill(frames, hole (T, H, W) bool, settings, progress) -> (rgb (T, H, W, 3) uint8, origin (T, H, W) uint8)
"""
