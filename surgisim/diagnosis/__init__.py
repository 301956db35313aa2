"""What physics was left out: where a recording departs from its simulation, which law explains it, how surely."""
