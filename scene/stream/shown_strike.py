"""The strike that an armature's own motion shows: Play Live without a stream."""

from __future__ import annotations

import bpy

from ...beyond_mocap.annotation.striking import SIDED_PARTS
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.passes.hits import HitMotion, detect_hits
from ..core import action


def find_shown_strike(scene: bpy.types.Scene, body: bpy.types.Object) -> HitMotion:
    """Find the strike of an armature's own motion that is nearest to the current frame.

    Raises:
        InputError: if it has none.
    """
    settings, motion = scene.beyond_mocap_stream, action.read_motion(body, scene)
    sided = settings.part in SIDED_PARTS
    sides = (("left", "right") if settings.side == "either" else (settings.side,)) if sided else ("",)
    hits = [hit for side in sides for hit in detect_hits(motion, settings.part, side, settings.threshold
                                                         or None).motions]
    if not hits:
        raise InputError(f"armature {body.name}", f"no strike with the {settings.part}", "at least one",
                         "choose the part under Live Stream")
    now = scene.frame_current - (action.find_first_frame(body) or 0)
    return min(hits, key=lambda hit: (abs(hit.key - now), -hit.max_speed))
