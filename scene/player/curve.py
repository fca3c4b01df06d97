"""A player's track as a curve on the ground."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.material import colour
from ..core.measure import units_per_metre

HEIGHT, WIDTH = 0.015, 0.03  # metres above the ground, half the ribbon's width


def write(context: bpy.types.Context, name: str, points: np.ndarray, rgb, collection) -> bpy.types.Object:
    """A ribbon along `points` (N, 2) metres, coloured `rgb`; takes the place of that name's object in `collection`."""
    units = units_per_metre(context.scene)
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions = "3D"
    data.extrude, data.twist_mode = WIDTH * units, "Z_UP"
    line = data.splines.new("POLY")
    line.points.add(len(points) - 1)
    placed = np.ones((len(points), 4), np.float32)
    placed[:, :2], placed[:, 2] = np.asarray(points) * units, HEIGHT * units
    line.points.foreach_set("co", placed.ravel())
    line.points.foreach_set("tilt", np.full(len(points), -np.pi / 2, np.float32))  # its upper side looks up
    data.materials.append(colour(f"{name} colour", tuple(rgb), 0.9))
    ribbon = collection.objects.get(name)
    if ribbon is None or ribbon.type != "CURVE":
        ribbon = bpy.data.objects.new(name, data)
        collection.objects.link(ribbon)
    else:
        old, ribbon.data = ribbon.data, data
        if not old.users:  # a preview may have set it aside
            bpy.data.curves.remove(old)
            data.name = name
    ribbon.hide_select = True
    return ribbon
