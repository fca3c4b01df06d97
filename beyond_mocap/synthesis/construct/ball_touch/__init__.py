"""What a touch of the ball consists of: its frames, how far a body reaches, its problem, and the reach for the ball."""
