"""Was the diagnosis right? What was sealed is opened here, and nowhere else, and held against what was said."""
