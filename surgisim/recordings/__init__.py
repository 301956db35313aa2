"""Recordings that are not videos: tracked points of a body whose shape and holders are known."""
