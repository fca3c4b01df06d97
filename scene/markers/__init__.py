"""Optical markers: a trial as a cloud of vertices that plays without the extension, its labels and segments, and its
reconstruction as a moving body.

- `settings`   the properties of a cloud, and the scene's settings - `nodes`      the node group that plays
trajectories; edges and colours by segment - `cloud`      a trial as objects, and back; labels drawn at the markers -
`sets`       the labels as a marker set, and a marker set applied to the labels - `solve`      the request of a
reconstruction, and its result: body, model and the thrown ball
"""

REGISTERED = ("cloud", "settings")
