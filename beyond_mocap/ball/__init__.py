"""Ball physics (flight, bounce, roll), launches towards a target, and the ball's trajectory from tracking data."""
