"""Many bodies on one pitch: how deep they are in each other, and how they are brought out of it."""
