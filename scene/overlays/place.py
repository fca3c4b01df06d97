"""Where a take lies in the scene now, and what its clock shows."""

from __future__ import annotations

import bpy
from mathutils import Matrix

from ..core.action import PLACED
from ..core.measure import frames_per_second, units_per_metre


def seconds_at(scene: bpy.types.Scene, frame: float | None = None) -> float:
    """What the tracking file's clock shows at a scene frame, or now."""
    settings = scene.beyond_mocap
    frame = scene.frame_current_final if frame is None else frame
    return settings.start_time + (frame - settings.start_frame) / frames_per_second(scene)


def take_to_world(scene: bpy.types.Scene, body: bpy.types.Object | None) -> Matrix:
    """From a take's metres to the scene's units: where the body was, and with it where the user has moved it since."""
    scale = Matrix.Scale(units_per_metre(scene), 4)
    written = _written(body) if body is not None else None
    return scale if written is None else body.matrix_world @ written.inverted_safe() @ scale


def _written(body: bpy.types.Object) -> Matrix | None:
    """The armature's matrix when its take was written."""
    for action in _actions(body):
        if (numbers := action.get(PLACED)) is not None:
            rows = list(numbers)
            return Matrix([rows[i : i + 4] for i in range(0, 16, 4)])
    return None


def _actions(body: bpy.types.Object):
    """The actions that an object plays: its own, and those of its strips."""
    data = body.animation_data
    if data is not None:
        yield from filter(None, [data.action])
        yield from (strip.action for track in data.nla_tracks for strip in track.strips if strip.action)
