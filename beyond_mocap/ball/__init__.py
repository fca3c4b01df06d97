"""How the ball flies, bounces and rolls; its path from tracking data."""
