"""Optical markers: a trial as a cloud of vertices that plays without the extension, its names and segments, and the
way from it to a body that moves.

- `settings`   what a cloud keeps, and what the panel shows
- `nodes`      the node group that plays trajectories; which markers belong together, drawn as edges and colours
- `cloud`      a trial as objects, and back; names drawn at the markers
- `sets`       the labels as a marker set, and a marker set on the labels
- `solve`      what the recipe gets of a cloud; the body, its model and the ball that left the hand
"""
