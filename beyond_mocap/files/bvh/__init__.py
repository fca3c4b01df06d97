"""BVH files in and out."""
