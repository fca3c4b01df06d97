"""The labels of the active cloud, drawn at its markers in the 3D view."""

from __future__ import annotations

import bpy
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

from ..core.live import Watcher
from . import cloud as clouds
from .settings import is_cloud

WIDE = 32  # pixels of a label, at a scale of 1
SIZE, RGBA, FREE = 11, (1.0, 1.0, 1.0, 0.9), (1.0, 0.65, 0.1, 1.0)


def labels(context: bpy.types.Context) -> list[tuple[Vector, str, tuple]]:
    """What is written where: (place in the world, label, colour) of every marker that is seen now."""
    thing = context.view_layer.objects.active
    if not context.scene.beyond_mocap_markers.names or not is_cloud(thing) or not thing.visible_get():
        return []
    rows = thing.beyond_mocap_cloud.labels
    found = []
    for marker, place in clouds.places_at(thing, context.scene.frame_current_final):
        if marker < len(rows):
            colour = RGBA if rows[marker].segment or rows[marker].role in ("BALL", "OTHER") else FREE
            found.append((thing.matrix_world @ place, rows[marker].name, colour))
    return found


def _draw() -> None:
    import blf

    context = bpy.context
    if context.space_data is None or not context.space_data.overlay.show_overlays:
        return
    scale, taken = context.preferences.system.ui_scale, set()
    blf.size(0, SIZE * scale)
    for place, text, rgba in labels(context):
        at = location_3d_to_region_2d(context.region, context.region_data, place)
        cell = at and (round(at.x / (WIDE * scale)), round(at.y / (SIZE * scale)))
        if cell and cell not in taken:  # one over the other cannot be read
            taken.add(cell)
            blf.color(0, *rgba)
            blf.position(0, at.x + 6 * scale, at.y + 3 * scale, 0)
            blf.draw(0, text)


WATCHER = Watcher(name="Marker labels", draws=((bpy.types.SpaceView3D, _draw, "POST_PIXEL"),))
