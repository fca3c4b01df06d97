"""Riders follow while curves, settings and grounds are edited, also while a point is being dragged.

Blender says after every change that something has changed; a timer, which runs during modal operators too, then
compares what each rider's motion was made of with what there is now. Our own writes are such changes too, and find
nothing to do. An edit from a timer is no undo step: undo brings back the state before, and riders are brought up to
date with that.
"""

from __future__ import annotations

import bpy

from ..core.live import Watcher, attempt
from . import riders as rides
from . import source
from .riders import shown  # noqa: F401  (what overlays draw)
from .settings import riders

MATTERS = (bpy.types.Object, bpy.types.Curve, bpy.types.Mesh, bpy.types.Armature, bpy.types.Action, bpy.types.Scene)


def follow(scene: bpy.types.Scene) -> int:
    """Bring all live riders of a scene up to date; how many had to be. What cannot be is told at the rider, whose
    motion stays as it was."""
    count = 0
    for body in riders(scene):
        if not body.beyond_mocap_ride.live or body.mode == "EDIT" or body.library is not None:
            continue
        failed = f"{body.name}: the motion could not be worked out here"
        count += bool(attempt(lambda: rides.renew(scene, body), lambda text: rides.tell(body, text), failed))
    return count


WATCHER = Watcher(
    name="Path editing", matters=MATTERS, follow=follow, restored=source.unsure, loaded=rides.forget, ends=rides.forget,
    framed=lambda _scene: WATCHER.mark(),  # an edit that a change of frame brings into force is told by nothing else
)
