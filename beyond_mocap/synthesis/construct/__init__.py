"""Construction of the final motion: place source frames on a track, plant the feet, solve the ball contact."""
