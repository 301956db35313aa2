"""Another simulator and another camera than the project's own, for clips whose truth is known.

Nothing here imports the rooms that it is used to test; a test holds that wall.
"""
