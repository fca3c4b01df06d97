"""Pictures of players of a made match, for the page over it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from ...appearance.picture import pose_picture
from ...base.errors import BeyondMocapError
from ...library.library import Library
from ..folder import read_state
from ..shown import shown
from ..take_npz import read_player

SIZE = 224
"""Pixels of a side."""


def thumbnails(library: Library, folder: Path) -> Callable[[str, float], np.ndarray | None]:
    """What draws a player at a second of the match: (SIZE, SIZE, 4) as `pose_picture` does, None where he has no motion
    then or his edit list cannot be read. InputError where the folder has no match.json."""
    files: Mapping[str, str] = {row["id"]: str(row.get("file", row["id"])) for row in read_state(folder)["players"]}

    def drawn(player: str, second: float) -> np.ndarray | None:
        path = folder / f"{files[player]}.take.npz"
        try:
            takes = shown(library, read_player(path), None, second, second + 1.0)
            return pose_picture(takes[0].motion, 0, SIZE) if takes else None
        except BeyondMocapError:
            return None

    return drawn
