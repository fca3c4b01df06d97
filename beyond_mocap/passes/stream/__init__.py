"""Motion that arrives while it is made: BVH frames over the machine's own network, and the hits in them."""
