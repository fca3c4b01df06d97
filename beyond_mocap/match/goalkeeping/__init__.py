"""Goalkeepers: shots at their goal and what they do about them, and where they stand while the feed does not say."""
