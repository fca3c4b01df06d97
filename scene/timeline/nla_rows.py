"""Where Blender has drawn the tracks of an object in the NLA editor: found in the picture itself.

Blender tells no script which channels are folded, so the rows cannot be computed. They lie on a grid, which can be; and
the strips on each row show at known places in the theme's colours. Two lines of pixels of each row of the grid, near
its edges where no text is, are compared with what each track has. Where nothing fits, nothing is drawn.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

TOLERANCE = 4  # steps of 255 by which a pixel of a strip may differ from the theme's colour
ENOUGH = 0.8  # share of the looked-at places that must fit
LEAST = 4  # pixels: narrower strips and gaps are not looked at
NEAR = (-4, -2, 0, 2, 4)  # pixels around a place on a strip, of which one may fit: Blender draws markers over strips
MOST = 12  # strips, and gaps, of a track that are looked at
LEAST_TINT = 0.05  # of a theme's colour, from grey: with less, rows of keys cannot be told
BAND_STEP, BAND_SHARE = 7, 0.98  # every so many pixels of a line; share of them that are tinted
LOOK_AT = 0.2  # of a row's height from its edges: within the outline, beside the text


class RowGrid(NamedTuple):
    """The rows of an NLA editor, in the view's vertical units (0 at the top, downward negative).

    Attributes:
        top: of the first row.
        height: of a row.
        step: from a row to the next.
        skip: between two rows.
    """

    top: float
    height: float
    step: float
    skip: float

    def compute_span(self, row: int) -> tuple[float, float]:
        """Compute bottom and top of a row."""
        top = self.top - row * self.step
        return top - self.height, top


class TrackPattern(NamedTuple):
    """What a track shows.

    Attributes:
        strips: (left, right) in pixels of the region, by left.
        colours: (red, green, blue) of each, 0 to 255.
    """

    strips: tuple[tuple[float, float], ...]
    colours: tuple[tuple[int, int, int], ...]


def build_grid(ui_scale: float, pixel_size: float, has_strip_curves: bool) -> RowGrid:
    """Build the grid of rows.

    Args:
        ui_scale, pixel_size: of the preferences.
        has_strip_curves: whether the editor shows strips' control curves, which makes rows higher.
    Source: Blender, header ED_anim_api, NLATRACK_FIRST_TOP, NLATRACK_HEIGHT and NLATRACK_STEP.
    """
    unit = int(np.float32(18.0) * np.float32(ui_scale) + np.float32(0.5)) + 2 * int(pixel_size)
    height, skip = (1.2 if has_strip_curves else 0.8) * unit, 0.1 * unit
    return RowGrid(-23.0 * ui_scale - skip, height, height + skip, skip)


def find_rows(blocks: list[list[TrackPattern]], lines: np.ndarray, known: np.ndarray,
              limits: tuple[float, float]) -> list[int | None]:
    """Find the first row of each block of tracks, from top to bottom.

    Args:
        blocks: of each object, its tracks from top to bottom, in the order of the editor.
        lines: (R, 2, W, 3) uint8, two lines of pixels of each row of the grid.
        known: (R,) whether both are in view.
        limits: left and right of the pixels to look at; beyond a preview range Blender shades all colours.
    Returns:
        For each block the row of its first track, or None.
    """
    found, first = [], 0
    strip_colours = np.array(sorted({colour for block in blocks for track in block for colour in track.colours}),
                             np.int16).reshape(-1, 3)
    for block in blocks:
        row = _find_block([_list_fits(track, lines, strip_colours, limits) for track in block], known, first)
        found.append(row)
        first = first if row is None else row + len(block)
    return found


def find_bands(lines: np.ndarray, known: np.ndarray, colour: tuple[float, ...]) -> list[int]:
    """Find the rows of objects' own keys, which Blender tints from end to end.

    Args:
        lines: as for `find_rows`.
        known: as for `find_rows`.
        colour: (red, green, blue, alpha) of the theme's active action, 0 to 1.
    Returns:
        The rows, from top to bottom.
    """
    tint, alpha = np.array(colour[:3]) - np.mean(colour[:3]), max(colour[3], 1e-3)
    if np.linalg.norm(tint) < LEAST_TINT:
        return []
    pixels = lines[:, :, ::BAND_STEP] / 255.0
    shares = (pixels - pixels.mean(axis=-1, keepdims=True)) @ tint / (tint @ tint)  # of the tint in each pixel
    is_tinted = (shares > 0.6 * alpha).mean(axis=(1, 2)) >= BAND_SHARE
    return [int(row) for row in np.flatnonzero(is_tinted & known)]


def _find_block(fits, known: np.ndarray, first: int) -> int | None:
    """Find the first row from `first` on at which all tracks of a block fit."""
    rows = len(known)
    for row in range(first, rows):
        seen = [(places, row + offset) for offset, track in enumerate(fits) if row + offset < rows
                and known[row + offset] for places in track]
        if any(is_strip and len(fit[at]) for (is_strip, fit), at in seen) and all(
                fit[at].mean() >= ENOUGH for (_, fit), at in seen if len(fit[at])):
            return row
    return None


def _list_fits(track: TrackPattern, lines: np.ndarray, colours: np.ndarray, limits: tuple[float, float]):
    """List where a track's strips, then its gaps, fit: pairs of whether these are strips, and (R, places)."""
    low, high = limits
    seen = [(max(left, low), min(right, high), colour) for (left, right), colour in zip(track.strips, track.colours)]
    seen = _thin([one for one in seen if one[1] - one[0] >= LEAST])
    places = [int(left + share * (right - left)) for left, right, _ in seen for share in (0.3, 0.7)]
    wanted = [colour for _, _, colour in seen for _ in range(2)]
    around = np.clip(np.array(places, int).reshape(-1, 1) + NEAR, 0, lines.shape[2] - 1)
    on_strips = _is_near(lines[:, :, around], np.array(wanted, np.int16).reshape(-1, 1, 3)).any(axis=3)
    beside = ~_is_near(lines[:, :, _list_gaps(track.strips, limits), None], colours).any(axis=3)
    return (True, on_strips.reshape(len(lines), -1)), (False, beside.reshape(len(lines), -1))


def _is_near(pixels: np.ndarray, colours: np.ndarray) -> np.ndarray:
    """Return where pixels (..., 3) have these colours."""
    return np.abs(pixels.astype(np.int16) - colours).max(axis=-1) <= TOLERANCE


def _list_gaps(strips, limits: tuple[float, float]) -> list[int]:
    """List places between the strips, and beside them."""
    edges = [limits[0], *(edge for strip in strips for edge in strip), limits[1]]
    gaps = [(max(a, limits[0]), min(b, limits[1])) for a, b in zip(edges[::2], edges[1::2])]
    return _thin([int(0.5 * (a + b)) for a, b in gaps if b - a >= 2 * LEAST])


def _thin(items: list) -> list:
    """Choose at most MOST of the items, evenly."""
    return items if len(items) <= MOST else [items[number * (len(items) - 1) // (MOST - 1)] for number in range(MOST)]
