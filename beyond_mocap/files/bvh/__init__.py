"""Read and write BVH files."""
