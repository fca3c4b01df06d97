"""Hit analysis of an armature: what the core finds in its motion, kept for the panel and set as markers on its
action."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ..core import action, channels
from ..core.live import Watcher
from ..path_editing.rigs import carrier_of, rides_as_rig
from . import graph

if TYPE_CHECKING:
    from ...beyond_mocap.motion.motion import Motion
    from ...beyond_mocap.passes.hits import Hits

MARKER = "hit"  # the names of our markers begin with it
_COLUMNS = 480


def motion_of(scene: bpy.types.Scene, body: bpy.types.Object) -> tuple["Motion", int]:
    """What an armature does, at the scene's rate, and the scene frame of its first pose. InputError where it does not
    move."""
    if body.beyond_mocap_ride.on or (channels.playing(body)[0] is not None and not rides_as_rig(body)):
        return action.read(body, scene), action.first_frame(body)
    read = carrier_of(body).read(scene)
    return read.motion, read.first


def analyse(
    scene: bpy.types.Scene, body: bpy.types.Object, part: str, side: str, threshold: float = 0.0, bone: str = "",
    markers: bool = True,
) -> "Hits":
    """Find the strikes in an armature's motion, note them for the panel and mark them on its action.

    part, side, bone, threshold: see `beyond_mocap.passes.hits.analyse`; threshold 0: automatic. markers: whether to
    mark.
    """
    from ...beyond_mocap.passes.hits import analyse as find

    channels.check_local(body)
    motion, first = motion_of(scene, body)
    if not np.isfinite(motion.root_positions).all() or not np.isfinite(motion.rotations).all():
        raise InputError(f"armature {body.name}", "a pose that is no number", "numbers", "look at its keys")
    found = find(motion, part, side, threshold or None, bone or None)
    hits = body.beyond_mocap_hits
    hits.part, hits.side, hits.bone, hits.threshold = part, side or "right", bone, threshold
    hits.found = json.dumps(summary(found, first))
    hits.lines = "\n".join(lines(found, first))
    played = channels.playing(body)[0]
    if played is not None and played.library is None:
        unmark(played)
        if markers:
            mark(played, found, first)
    graph.paint(hits)
    return found


def summary(found: "Hits", first: int) -> dict:
    """What is kept of an analysis: curves of `_COLUMNS` values at most, and frames of the motion. first: scene frame of
    the motion's first."""
    count = len(found.height)
    at = np.linspace(0, count - 1, min(count, _COLUMNS))
    curves = {
        name: np.round(np.interp(at, np.arange(count), getattr(found, name)), 3).tolist()
        for name in ("height", "speed")
    }
    return {
        "first": int(first), "count": count, "fps": round(float(found.fps), 4),
        "threshold": round(float(found.threshold), 4), **curves, "highs": [int(frame) for frame in found.highs],
        "fasts": [int(frame) for frame in found.fasts], "stretches": _pairs(found.ball_stretches),
        "links": _pairs(found.links), "motions": [[int(one.first), int(one.last)] for one in found.motions],
        "keys": [int(one.key) for one in found.motions],
    }


def lines(found: "Hits", first: int) -> list[str]:
    """A line for each hit motion: the scene frame of its strike, a tab, its speed, and the frames between which a ball
    can be hit."""
    told = []
    for one in found.motions:
        low, high = (first + frame for frame in one.ball_stretch)
        told.append(f"{first + one.key}\t{one.max_speed:.1f} m/s, ball {low} to {high}")
    return told


def mark(played: bpy.types.Action, found: "Hits", first: int) -> None:
    """Markers on an action: the strike, and where its ball stretch begins and ends."""
    name = " ".join(filter(None, (found.side, found.part)))
    for one in found.motions:
        low, high = one.ball_stretch
        for frame, text in ((low, f"{MARKER} from"), (high, f"{MARKER} to"), (one.key, f"{MARKER} {name}")):
            marker = played.pose_markers.new(text)
            marker.frame, marker.beyond_mocap.shown = int(first + frame), marker.name


def unmark(played: bpy.types.Action) -> None:
    """Take our markers off an action; others stay."""
    for marker in [marker for marker in played.pose_markers if is_ours(marker)]:
        played.pose_markers.remove(marker)


def is_ours(marker: bpy.types.TimelineMarker) -> bool:
    """Whether a hit analysis has set it, and nobody has renamed it since."""
    record = marker.beyond_mocap
    return record.kind == "none" and record.shown == marker.name and marker.name.startswith(MARKER)


def repaint() -> None:
    """Paint the pictures of all armatures that have an analysis, where there is a window to show them: another file is
    open, or something was undone."""
    for thing in () if bpy.app.background else bpy.data.objects:
        if thing.type == "ARMATURE" and thing.beyond_mocap_hits.found:
            graph.paint(thing.beyond_mocap_hits)


def _pairs(stretches) -> list[list[int]]:
    return [[int(first), int(last)] for first, last in stretches]


WATCHER = Watcher(name="Hit analysis", restored=repaint, loaded=repaint, ends=graph.forget)
