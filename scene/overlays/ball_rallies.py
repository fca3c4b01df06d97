"""What is drawn of a passing scene, as in Ball handling Fig. 6: the flight in which the ball is just now in white,
before it those that its strike could have given in black, other flights thin; where strikes are, and where the ball
bounces.

Every shape hangs on the very rally that it was made of. Knows neither gpu nor how to draw.
"""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

from ..core.measure import frames_per_second, units_per_metre
from ..passes import make
from . import colours, shapes
from .prepare import Mesh
from .rides import Item

CROSS, RING, LIFT = 0.09, 0.14, 0.012  # metres
WIDE, THIN = 3.5, 1.5  # pixels


def items(scene: bpy.types.Scene) -> list[Item]:
    """All that is to be drawn at the current frame."""
    shown = seen(scene)
    if shown is None:
        return []
    world = Matrix.Scale(units_per_metre(scene), 4)
    seconds = (scene.frame_current_final - shown.start) / frames_per_second(scene)
    now = shown.flight_at(seconds)
    return [
        Item((shown, "all"), lambda: whole(shown), world),
        Item((shown, "flight", now), lambda: flight(shown, now), world),
    ]  # fmt: skip


def seen(scene: bpy.types.Scene) -> make.Rally | None:
    """The rally of which anything is to be drawn."""
    view = scene.beyond_mocap.view
    return make.rally_of(scene) if make.has_rallies() and view.show and view.shots else None


def whole(shown: make.Rally) -> list[Mesh]:
    """All flights, strikes and bounces."""
    lines = np.concatenate([shapes.along(way) for way in shown.ways])
    found = [Mesh("LINES", lines, colours.repeated(colours.GREY, len(lines), 0.6), THIN)]
    if len(shown.strikes):
        crosses = np.concatenate([shapes.cross(place, CROSS) for place in shown.strikes])
        found.append(Mesh("LINES", crosses, colours.repeated(colours.STRIKE, len(crosses)), WIDE))
    if len(shown.bounces):
        rings = np.concatenate(
            [shapes.circle(place + [0.0, 0.0, LIFT], RING) for place in shown.bounces]
        ).astype(np.float32)
        found.append(Mesh("LINES", rings, colours.repeated(colours.ORANGE, len(rings)), 2.5))
    return found


def flight(shown: make.Rally, now: int) -> list[Mesh]:
    """One flight, and those that its strike could have given."""
    line, found = shapes.along(shown.ways[now]), []
    strike = int(np.searchsorted(shown.strike_times, shown.starts[now] + 1e-6)) - 1
    if strike >= 0 and shown.candidates[strike].size:
        few = shown.candidates[strike]
        lines = np.stack([few[:, :-1], few[:, 1:]], axis=2).reshape(-1, 3).astype(np.float32)
        found.append(Mesh("LINES", lines, colours.repeated(colours.BLACK, len(lines), 0.75), THIN))
    return [*found, Mesh("LINES", line, colours.repeated(colours.WHITE, len(line)), WIDE)]
