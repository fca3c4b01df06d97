"""Pictures for the page over a match: how bad a player is over time, as a strip that needs no library, and players at a
second.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ...appearance.picture import encode_png, render_pose
from ...base.errors import BeyondMocapError
from ...library.library import Library
from ...synthesis.take import Take
from ..displayed_motion import MARGIN_SECONDS, construct_displayed_player, display_takes
from ..folder import read_state
from ..player_file import read_player

MAX_CELLS = 900
"""Most cells of a strip; if a match has more seconds, each cell shows the worst of its seconds."""
FULL_COLOUR = 3.0
"""Multiple of the limit at which the colour scale ends."""
_GOOD, _LIMIT, _BAD = np.array([[226, 240, 229], [250, 205, 110], [170, 20, 20]], float)
_ABSENT = np.array([236, 236, 236], float)
PICTURE_SIZE = 224
"""Pixels, side of a player's picture."""


def render_heat_strip(bad: np.ndarray, start: float, span: tuple[float, float]) -> bytes:
    """Render the strip of one player, a pixel high.

    Args:
        bad: (S,) multiples of the limit, one per second, NaN where the player has no motion.
        start: s of the first value.
        span: first and last second of the strip.
    Returns:
        PNG.
    """
    first, count = int(np.floor(span[0])), max(int(np.ceil(span[1]) - np.floor(span[0])), 1)
    whole = np.full(count, np.nan)
    rows = np.arange(len(bad)) + round(start) - first
    inside = (rows >= 0) & (rows < count)
    whole[rows[inside]] = bad[inside]
    cells = min(count, MAX_CELLS)
    edges = np.linspace(0, count, cells + 1).astype(int)[:-1]
    return encode_png(compute_colours(np.fmax.reduceat(whole, edges))[None])


def build_thumbnail_renderer(
    library: Library, folder: Path, load_takes: Callable[[str, float, float], Sequence[Take] | None] | None = None
) -> Callable[[str, float], np.ndarray | None]:
    """Build a function that renders a player at a second of the match.

    Args:
        library: the clips.
        folder: the match's folder.
        load_takes: loads what a player, by id, does from one second to another, as `construct_player` constructs it;
            None, or a result of None: it is constructed.
    Returns:
        A function of id and second that gives (PICTURE_SIZE, PICTURE_SIZE, 4) as `render_pose` does, or None if the
        player has no motion then or their edit list cannot be read.
    Raises:
        InputError: if the folder has no match.json.
    """
    files: Mapping[str, str] = {row["id"]: str(row.get("file", row["id"])) for row in read_state(folder)["players"]}

    def render_thumbnail(player: str, second: float) -> np.ndarray | None:
        path = folder / f"{files[player]}.take.npz"
        try:
            edit, end = read_player(path), second + 1.0
            stored = load_takes and load_takes(player, second - MARGIN_SECONDS, end + MARGIN_SECONDS)
            takes = (construct_displayed_player(library, edit, None, second, end) if stored is None
                     else display_takes(stored, edit.correction, None, second, end))
            return render_pose(takes[0].motion, 0, PICTURE_SIZE) if takes else None
        except BeyondMocapError:
            return None

    return render_thumbnail


def compute_colours(bad: np.ndarray) -> np.ndarray:
    """Compute colours (..., 3) uint8 of badness (...): pale green up to half the limit, amber at it, dark red from
    FULL_COLOUR, grey for NaN.
    """
    known = np.clip(np.nan_to_num(np.asarray(bad, float))[..., None], 0.0, FULL_COLOUR)
    below = _GOOD + (_LIMIT - _GOOD) * np.clip(2.0 * known - 1.0, 0.0, 1.0)
    above = _LIMIT + (_BAD - _LIMIT) * (known - 1.0) / (FULL_COLOUR - 1.0)
    out = np.where(np.isnan(bad)[..., None], _ABSENT, np.where(known <= 1.0, below, above))
    return np.rint(out).astype(np.uint8)
