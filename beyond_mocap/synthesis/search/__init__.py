"""Searches for the clip frame that each output frame shows (`path`, `blocks` and `distance`), and their costs."""
