"""Optical markers: a trial as a cloud of vertices that plays without the extension, its names and segments, and the
way from it to a body that moves.

- `settings`   what a cloud keeps, and what the panel shows
- `nodes`      the node group that plays trajectories
- `cloud`      a trial as objects, and back
- `lines`      which markers belong together, drawn as edges and colours
- `labels`     names drawn at the markers
- `sets`       the labels as a marker set, and a marker set on the labels
- `solve`      what the recipe gets of a cloud, and the body that comes out
- `models`     the body's model as a text of the file
- `thrown`     the ball that left the hand
- `kept`       reconstructions of this session, at the recording's own rate
"""
