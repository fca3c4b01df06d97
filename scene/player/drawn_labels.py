"""Speeds beside the points of the active player's drawn curve, and seconds beside his pins, in the 3D view."""

from __future__ import annotations

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d

from ...beyond_mocap.base.errors import InputError
from ..core.live import Watcher
from ..core.measure import units_per_metre
from ..core.settings import active_player
from . import drawn_track

SIZE, RGBA, PIN_RGBA = 12, (1.0, 0.85, 0.2, 1.0), (0.4, 0.9, 1.0, 1.0)


def labels(scene: bpy.types.Scene) -> list[tuple[tuple[float, float, float], str, tuple]]:
    """What is written where: (place in Blender's units, text, colour)."""
    player, units = active_player(scene.beyond_mocap), units_per_metre(scene)
    if player is None:
        return []
    found = []
    drawn = player.drawn_track
    if drawn is not None and drawn.type == "CURVE" and drawn.visible_get():
        try:
            line = drawn_track.line_of(scene, drawn)
        except InputError:  # told when it is used
            line = drawn_track.NO_LINE
        for at, speed, wait in zip(line.at, line.speeds, line.waits):
            text = f"{speed:.1f} m/s" if speed > 0.0 else f"stop {wait:.1f} s"
            found.append((tuple(np.array(line.line[at]) * units), text, RGBA))
    for pin in player.pins:
        if pin.target is not None and pin.target.visible_get():
            hold = f" + {pin.hold:.1f}" if pin.hold else ""
            found.append((tuple(pin.target.matrix_world.translation), f"{pin.time:.1f}{hold} s", PIN_RGBA))
    return found


def _draw() -> None:
    import blf

    context = bpy.context
    if context.space_data is None or not context.space_data.overlay.show_overlays:
        return
    scale = context.preferences.system.ui_scale
    for place, text, rgba in labels(context.scene):
        at = location_3d_to_region_2d(context.region, context.region_data, place)
        if at is not None:
            blf.size(0, SIZE * scale)
            blf.color(0, *rgba)
            blf.position(0, at.x + 8 * scale, at.y + 8 * scale, 0)
            blf.draw(0, text)


WATCHER = Watcher(name="Labels of drawn tracks", draws=((bpy.types.SpaceView3D, _draw, "POST_PIXEL"),))
