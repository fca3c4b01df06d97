"""Labels as strips and key moments; the reference video."""
