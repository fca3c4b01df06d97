"""Bodies from skeletal tracking: noisy joints become the motion of one body with bones of fixed length."""
