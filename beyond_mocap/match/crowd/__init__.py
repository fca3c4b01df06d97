"""Collision avoidance between the players on one pitch: how deep bodies overlap, and how they are separated."""
