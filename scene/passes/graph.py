"""The curves of a hit analysis as a small picture for the panel (Ball handling Fig. 2).

Above the height of the part, below its speed. Thin red lines stand where it is highest, magenta ones where it is
fastest, as in the paper; at the foot red bars are the stretches in which a ball can be hit, blue ones the hit motions.
"""

from __future__ import annotations

import bpy
import bpy.utils.previews
import numpy as np

from .settings import BeyondMocapHits, found_of, picture_name, pictures

SIZE = 480
"""Pixels of the picture's width and height."""

_GROUND, _GRID = (0.09, 0.09, 0.10), (0.20, 0.20, 0.22)
_HEIGHT, _SPEED = (0.95, 0.95, 0.95), (0.30, 0.80, 1.0)
_HIGH, _FAST, _LEVEL = (0.95, 0.25, 0.22), (0.90, 0.30, 0.90), (0.60, 0.52, 0.20)
_STRETCH, _MOTION, _PLAYHEAD = (0.95, 0.25, 0.22), (0.28, 0.45, 0.95), (0.95, 0.75, 0.2)
_EDGE, _BARS = 6, 44  # pixels round the curves, and of the bars at the foot

def paint(hits: BeyondMocapHits) -> None:
    """Paint the picture of an analysis, where there is one and it is not painted yet."""
    name = picture_name(hits)
    if bpy.app.background or not hits.found:
        return
    if "graphs" not in pictures:
        pictures["graphs"] = bpy.utils.previews.new()
    if name in pictures["graphs"]:
        return
    pixels = picture(found_of(hits))
    preview = pictures["graphs"].new(name)
    preview.image_size = pixels.shape[1], pixels.shape[0]
    preview.image_pixels_float = pixels.ravel().tolist()


def picture(found: dict) -> np.ndarray:
    """The picture (SIZE, SIZE, 4) float32, its lowest row first, of what `hits_shown.summary` says."""
    image = np.empty((SIZE, SIZE, 4), np.float32)
    image[..., :3], image[..., 3] = _GROUND, 1.0
    count, middle = max(found["count"] - 1, 1), _BARS + (SIZE - _BARS) // 2
    panes = ((middle + _EDGE, SIZE - _EDGE), (_BARS + _EDGE, middle - _EDGE))

    def column(frame: float) -> int:
        return int(round(_EDGE + frame / count * (SIZE - 1 - 2 * _EDGE)))

    for second in np.arange(0.0, found["count"], found["fps"]):
        image[_BARS:, column(second), :3] = _GRID
    image[middle, :, :3] = _GRID
    for first, last in found["motions"]:
        image[6:16, column(first) : column(last) + 1, :3] = _MOTION
    for first, last in found["stretches"]:
        image[22:38, column(first) - 1 : column(last) + 2, :3] = _STRETCH
    for (low, high), name, frames, colour, mark in (
        (panes[0], "height", "highs", _HEIGHT, _HIGH), (panes[1], "speed", "fasts", _SPEED, _FAST)
    ):
        values = np.array(found[name])
        top = max(float(values.max()), found["threshold"] if name == "height" else 0.0, 1e-6)
        bottom = min(float(values.min()), 0.0)
        for frame in found[frames]:
            image[low:high, column(frame), :3] = mark
        if name == "height":
            level = int(low + (found["threshold"] - bottom) / (top - bottom) * (high - low - 1))
            image[level, _EDGE : SIZE - _EDGE : 3, :3] = _LEVEL
        _draw_curve(image, low + (values - bottom) / (top - bottom) * (high - low - 1), colour)
    return image


def frame_at(found: dict, share: float) -> float:
    """The motion's frame at a share of the picture's width."""
    inner = (share * (SIZE - 1) - _EDGE) / (SIZE - 1 - 2 * _EDGE)
    return float(np.clip(inner, 0.0, 1.0) * max(found["count"] - 1, 1))


def forget() -> None:
    """Take all pictures away."""
    for kept in pictures.values():
        bpy.utils.previews.remove(kept)
    pictures.clear()


def _draw_curve(image: np.ndarray, heights: np.ndarray, colour) -> None:
    """A curve two pixels wide through heights (N,) px, spread over the picture's width."""
    columns = np.arange(_EDGE, SIZE - _EDGE)
    line = np.interp(columns, np.linspace(_EDGE, SIZE - 1 - _EDGE, len(heights)), heights)
    before, after = np.r_[line[:1], line[:-1]], np.r_[line[1:], line[-1:]]
    low = np.minimum(line, np.minimum(0.5 * (line + before), 0.5 * (line + after))) - 1.0
    high = np.maximum(line, np.maximum(0.5 * (line + before), 0.5 * (line + after))) + 1.0
    rows = np.arange(SIZE)[:, None]
    cover = np.clip(np.minimum(rows + 0.5 - low, high - rows + 0.5), 0.0, 1.0)[..., None]
    image[:, _EDGE : SIZE - _EDGE, :3] += cover * (np.array(colour) - image[:, _EDGE : SIZE - _EDGE, :3])
