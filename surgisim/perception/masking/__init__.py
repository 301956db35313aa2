"""Instrument, tissue, highlight. A backend is one file here with a function `tool`; its file name is its name.

tool(frames, given, settings, progress) -> (mask (T, H, W) bool, confidence (T,) 0-1)
"""
