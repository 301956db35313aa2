"""The scoreboard of a run of concealed recordings as one page."""
