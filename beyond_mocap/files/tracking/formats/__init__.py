"""Readers of tracking data that kloppy does not know: each makes `samples.MatchSamples` of a feed's files."""
