"""The players' names in the 3D view: above each head, never over one another, in place of Blender's names at the feet.

They follow Blender's own switches: *Viewport Overlays* and, within those, *Text Info*.
"""

from __future__ import annotations

from typing import NamedTuple

import blf
import bpy
import gpu
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

from ..core.live import Watcher
from ..core.measure import units_per_metre
from ..core.settings import find_active_player
from ..player.dots import BALL
from . import draw, text_places
from .colours import BLACK, WHITE

HEAD, DOT = 2.1, 0.6  # metres above the ground: over a body, over a dot alone
SIZE, PAD, GAP = 11, 5, 2  # points: letters, around them, between two names
FONT = 0


class NameLabel(NamedTuple):
    """A name to place.

    Attributes:
        text: the name.
        x, y: pixels of the point that it stands over.
        depth: distance from the eye.
        colour: of the player's shirt.
        is_active: whether it is the active player.
    """

    text: str
    x: float
    y: float
    depth: float
    colour: tuple[float, float, float]
    is_active: bool


def place_names(labels: list[NameLabel], measure, height: float,
                scale: float) -> list[tuple[NameLabel, text_places.Box]]:
    """Place names over their points so that none lies over another: the active and the near ones first.

    Args:
        labels: the names.
        measure: from a text to its pixels.
        height: of a name's box, pixels.
        scale: of the interface.
    Returns:
        Each name that found a place, with left, bottom, right, top; others are left out.
    """
    placed: list[tuple[NameLabel, text_places.Box]] = []
    for label in sorted(labels, key=lambda one: (not one.is_active, one.depth, one.text)):
        half = 0.5 * measure(label.text) + PAD * scale
        own = (label.x - half, label.y, label.x + half, label.y + height)
        box = text_places.find_free_box(own, [taken for _, taken in placed], GAP * scale)
        if box is not None:
            placed.append((label, box))
    return placed


def list_labels(context: bpy.types.Context) -> list[NameLabel]:
    """List the names of all players whose dot is in view, and of the ball where it is selected."""
    settings, scene = context.scene.beyond_mocap, context.scene
    active, units = find_active_player(settings), units_per_metre(scene)
    found = []
    for player in settings.players:
        dot, body = player.dot, player.body
        if dot is None or dot.name not in context.view_layer.objects or not dot.visible_get():
            continue
        is_over_body = body is not None and body.name in context.view_layer.objects and body.visible_get()
        found.append(_project(context, player.name, dot, (HEAD if is_over_body else DOT) * units, player == active))
    ball = scene.objects.get(BALL)
    if ball is not None and ball.name in context.view_layer.objects and ball.visible_get() and ball.select_get():
        found.append(_project(context, "Ball", ball, DOT * units, False))
    return [label for label in found if label is not None]


def _project(context, text: str, dot: bpy.types.Object, height: float, is_active: bool) -> NameLabel | None:
    region, view = context.region, context.region_data
    place = dot.matrix_world.translation + Vector((0.0, 0.0, height))
    at = location_3d_to_region_2d(region, view, place)
    if at is None or not (0 <= at.x <= region.width and 0 <= at.y <= region.height):
        return None
    return NameLabel(text, at.x, at.y, depth=(view.view_matrix @ place).length, colour=tuple(dot.color)[:3],
                     is_active=is_active)


def _draw() -> None:
    context = bpy.context
    overlay, settings = context.space_data.overlay, getattr(context.scene, "beyond_mocap", None)
    if settings is None or not overlay.show_overlays or not overlay.show_text or not settings.players:
        return
    scale = context.preferences.system.ui_scale
    blf.size(FONT, SIZE * scale)
    height = (SIZE + PAD) * scale
    names = place_names(list_labels(context), lambda text: blf.dimensions(FONT, text)[0], height, scale)
    gpu.state.blend_set("ALPHA")
    for label, (left, bottom, right, top) in reversed(names):
        draw.draw_box(left, bottom, right - left, top - bottom, (*BLACK, 0.75 if label.is_active else 0.5))
        draw.draw_box(left, bottom, right - left, 2 * scale, (*label.colour, 1.0))
        blf.color(FONT, *WHITE, 1.0 if label.is_active else 0.85)
        blf.position(FONT, left + PAD * scale, bottom + 4 * scale, 0.0)
        blf.draw(FONT, label.text)
        gpu.state.blend_set("ALPHA")  # drawing text ends it
    gpu.state.blend_set("NONE")


def _hide_own_names() -> None:
    """Hide the names that Blender draws at the feet, in files of earlier versions too."""
    for thing in bpy.data.objects:
        if thing.library is None and (thing.beyond_mocap_dot.player or thing.name == BALL):
            thing.show_name = False


WATCHER = Watcher(name="Names of players", loaded=_hide_own_names,
                  draws=((bpy.types.SpaceView3D, _draw, "POST_PIXEL"),))
