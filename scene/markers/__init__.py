"""Optical markers: a trial as a cloud of vertices that plays without the extension, its names and segments, and the
way from it to a body that moves.

- `settings`   what a cloud keeps, and what the panel shows
- `nodes`      the node group that plays trajectories
- `cloud`      a trial as objects, and back
- `lines`      which markers belong together, drawn as edges and colours
- `labels`     names drawn at the markers
"""
