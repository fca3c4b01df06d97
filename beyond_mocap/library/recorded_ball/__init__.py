"""The ball of a recording, beside its clip."""
