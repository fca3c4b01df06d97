"""Motion that arrives live: BVH frames over this machine's own network, and the hits in them."""
