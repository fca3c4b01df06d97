"""Hit analysis of an armature: its result for the panel, as markers on its action, and as a picture of its curves (Ball
handling, Fig. 2).
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import bpy
import bpy.utils.previews
import numpy as np

from ..core import action, channels
from ..core.live import Watcher
from ..path_editing import armature_adapter, rigs
from .settings import BeyondMocapHits, name_picture, parse_hits, pictures

if TYPE_CHECKING:
    from ...beyond_mocap.motion.motion import Motion
    from ...beyond_mocap.passes.hits import Hits

MARKER = "hit"  # the names of this extension's markers begin with it
_COLUMNS = 480  # most values of a stored curve
SIZE = 480  # pixels of the picture's width and height
_GROUND, _GRID = (0.09, 0.09, 0.10), (0.20, 0.20, 0.22)
_HEIGHT, _SPEED = (0.95, 0.95, 0.95), (0.30, 0.80, 1.0)
_HIGH, _FAST, _LEVEL = (0.95, 0.25, 0.22), (0.90, 0.30, 0.90), (0.60, 0.52, 0.20)
_STRETCH, _MOTION = (0.95, 0.25, 0.22), (0.28, 0.45, 0.95)
_EDGE, _BARS = 6, 44  # pixels around the curves, and of the bars at the bottom


def read_motion(scene: bpy.types.Scene, body: bpy.types.Object) -> tuple["Motion", int]:
    """Read the motion of an armature.

    Args:
        scene: the scene; the motion has its frame rate.
        body: the armature.
    Returns:
        motion: the motion.
        first: scene frame of its first pose.
    Raises:
        InputError: if the armature does not move.
    """
    moves = channels.find_playing_action(body)[0] is not None and not rigs.is_edited_as_rig(body)
    if body.beyond_mocap_ride.on or moves:
        return action.read_motion(body, scene), action.find_first_frame(body)
    carrier_motion = rigs.choose_adapter(body).read_motion(scene)
    return carrier_motion.motion, carrier_motion.first


def analyse_armature(
    scene: bpy.types.Scene, body: bpy.types.Object, part: str, side: str, threshold: float = 0.0, bone: str = "",
    markers: bool = True,
) -> "Hits":
    """Detect the strikes in an armature's motion, store them for the panel and mark them on its action.

    Args:
        scene: the scene.
        body: the armature.
        part, side: as in the core's `detect_hits`.
        threshold: metres above the ground; 0: automatic.
        bone: joint to use instead of the part; "" for none.
        markers: whether to set markers.
    Returns:
        The hit analysis.
    """
    from ...beyond_mocap.passes.hits import detect_hits as find

    channels.check_local(body)
    motion, first = read_motion(scene, body)
    armature_adapter.check_finite(body, motion)
    hits_found = find(motion, part, side, threshold or None, bone or None)
    hits = body.beyond_mocap_hits
    hits.part, hits.side, hits.bone, hits.threshold = part, side or "right", bone, threshold
    hits.found = json.dumps(summarize_hits(hits_found, first))
    hits.lines = "\n".join(describe_hits(hits_found, first))
    played_action = channels.find_playing_action(body)[0]
    if played_action is not None and played_action.library is None:
        remove_markers(played_action)
        if markers:
            set_markers(played_action, hits_found, first)
    paint_picture(hits)
    return hits_found


def summarize_hits(found: "Hits", first: int) -> dict:
    """Build what is stored of an analysis: curves of `_COLUMNS` values at most, and frames of the motion.

    Args:
        found: the hit analysis.
        first: scene frame of the motion's first frame.
    """
    count = len(found.height)
    at = np.linspace(0, count - 1, min(count, _COLUMNS))
    curves = {name: np.round(np.interp(at, np.arange(count), getattr(found, name)), 3).tolist()
              for name in ("height", "speed")}
    return {"first": int(first), "count": count, "fps": round(float(found.fps), 4),
            "threshold": round(float(found.threshold), 4), **curves, "highs": [int(frame) for frame in found.highs],
            "fasts": [int(frame) for frame in found.fasts], "stretches": _list_pairs(found.ball_stretches),
            "links": _list_pairs(found.links), "motions": [[int(one.first), int(one.last)] for one in found.motions],
            "keys": [int(one.key) for one in found.motions]}


def describe_hits(found: "Hits", first: int) -> list[str]:
    """Describe each hit motion in a line: scene frame of its strike, a tab, its speed, and when a ball can be hit."""
    rows = []
    for one in found.motions:
        low, high = (first + frame for frame in one.ball_stretch)
        rows.append(f"{first + one.key}\t{one.max_speed:.1f} m/s, ball {low} to {high}")
    return rows


def set_markers(played_action: bpy.types.Action, found: "Hits", first: int) -> None:
    """Set markers on an action: at the strike, and where its ball stretch begins and ends."""
    name = " ".join(filter(None, (found.side, found.part)))
    for one in found.motions:
        low, high = one.ball_stretch
        for frame, text in ((low, f"{MARKER} from"), (high, f"{MARKER} to"), (one.key, f"{MARKER} {name}")):
            marker = played_action.pose_markers.new(text)
            marker.frame, marker.beyond_mocap.shown = int(first + frame), marker.name


def remove_markers(played_action: bpy.types.Action) -> None:
    """Remove the markers that a hit analysis has set on an action; other and renamed markers stay."""
    for marker in list(played_action.pose_markers):
        record = marker.beyond_mocap
        if record.kind == "none" and record.shown == marker.name and marker.name.startswith(MARKER):
            played_action.pose_markers.remove(marker)


def repaint_all() -> None:
    """Paint all analyses if there is a window, after a file was opened or an undo."""
    for thing in () if bpy.app.background else bpy.data.objects:
        if thing.type == "ARMATURE" and thing.beyond_mocap_hits.found:
            paint_picture(thing.beyond_mocap_hits)


def _list_pairs(stretches) -> list[list[int]]:
    return [[int(first), int(last)] for first, last in stretches]


def paint_picture(hits: BeyondMocapHits) -> None:
    """Paint the picture of an analysis, unless it is painted already."""
    name = name_picture(hits)
    if bpy.app.background or not hits.found:
        return
    if "graphs" not in pictures:
        pictures["graphs"] = bpy.utils.previews.new()
    if name in pictures["graphs"]:
        return
    pixels = build_picture(parse_hits(hits))
    preview = pictures["graphs"].new(name)
    preview.image_size = pixels.shape[1], pixels.shape[0]
    preview.image_pixels_float = pixels.ravel().tolist()


def build_picture(found: dict) -> np.ndarray:
    """Build the picture of an analysis.

    The upper curve is the part's height, the lower one its speed. Thin red lines mark the high frames, magenta ones the
    fast frames, as in the paper; at the bottom red bars are ball stretches, blue bars hit motions.

    Args:
        found: as `summarize_hits` builds it.
    Returns:
        (SIZE, SIZE, 4) float32, lowest row first.
    """
    image = np.empty((SIZE, SIZE, 4), np.float32)
    image[..., :3], image[..., 3] = _GROUND, 1.0
    count, middle = max(found["count"] - 1, 1), _BARS + (SIZE - _BARS) // 2
    panes = ((middle + _EDGE, SIZE - _EDGE), (_BARS + _EDGE, middle - _EDGE))

    def find_column(frame: float) -> int:
        """Column of the picture for a frame."""
        return int(round(_EDGE + frame / count * (SIZE - 1 - 2 * _EDGE)))

    for second in np.arange(0.0, found["count"], found["fps"]):
        image[_BARS:, find_column(second), :3] = _GRID
    image[middle, :, :3] = _GRID
    for first, last in found["motions"]:
        image[6:16, find_column(first) : find_column(last) + 1, :3] = _MOTION
    for first, last in found["stretches"]:
        image[22:38, find_column(first) - 1 : find_column(last) + 2, :3] = _STRETCH
    for (low, high), name, frames, colour, mark in (
        (panes[0], "height", "highs", _HEIGHT, _HIGH), (panes[1], "speed", "fasts", _SPEED, _FAST)
    ):
        values = np.array(found[name])
        top = max(float(values.max()), found["threshold"] if name == "height" else 0.0, 1e-6)
        bottom = min(float(values.min()), 0.0)
        for frame in found[frames]:
            image[low:high, find_column(frame), :3] = mark
        if name == "height":
            level = int(low + (found["threshold"] - bottom) / (top - bottom) * (high - low - 1))
            image[level, _EDGE : SIZE - _EDGE : 3, :3] = _LEVEL
        _draw_curve(image, low + (values - bottom) / (top - bottom) * (high - low - 1), colour)
    return image


def remove_pictures() -> None:
    """Remove all pictures."""
    for preview in pictures.values():
        bpy.utils.previews.remove(preview)
    pictures.clear()


def _draw_curve(image: np.ndarray, heights: np.ndarray, colour) -> None:
    """Draw a curve two pixels wide through heights (N,) px, spread over the picture's width."""
    columns = np.arange(_EDGE, SIZE - _EDGE)
    line = np.interp(columns, np.linspace(_EDGE, SIZE - 1 - _EDGE, len(heights)), heights)
    # each column covers the curve from half-way to its left neighbour to half-way to its right one
    before, after = np.r_[line[:1], line[:-1]], np.r_[line[1:], line[-1:]]
    low = np.minimum(line, np.minimum(0.5 * (line + before), 0.5 * (line + after))) - 1.0
    high = np.maximum(line, np.maximum(0.5 * (line + before), 0.5 * (line + after))) + 1.0
    rows = np.arange(SIZE)[:, None]
    # share of each pixel that the curve covers, for antialiasing
    cover = np.clip(np.minimum(rows + 0.5 - low, high - rows + 0.5), 0.0, 1.0)[..., None]
    image[:, _EDGE : SIZE - _EDGE, :3] += cover * (np.array(colour) - image[:, _EDGE : SIZE - _EDGE, :3])


WATCHER = Watcher(name="Hit analysis", restored=repaint_all, loaded=repaint_all, ends=remove_pictures)
