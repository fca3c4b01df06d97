"""A clip of a library: one recording or its mirrored twin."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..annotation import ClipAnnotation, swap_sides
from ..motion.mirror import mirror
from ..motion.motion import Motion
from . import repair
from .landings import LANDING_FOLDER
from .made import MADE_FOLDER


@dataclass(frozen=True, eq=False, kw_only=True)
class Clip:
    """One recording or its mirrored twin.

    path: below the library's folder, with slashes. motion: at its own rate, metres, the floor (2nd percentile of its
    toe heights, ../shared/metrics.md) at height 0. annotations: frames of its own rate, sides swapped on the twin.
    standing: (T, 2, 2) bool, left and right foot, whether heel and toe stand on the ground. recorded: number of frames
    that are recorded, where landing and getting up were made behind them (`library.landings`); None: all. mended: what
    the repair found and left; None of made clips."""

    path: str
    mirrored: bool
    motion: Motion
    annotations: tuple[ClipAnnotation, ...]
    standing: np.ndarray
    recorded: int | None = None
    mended: repair.Mended | None = None

    @property
    def made(self) -> bool:
        """Whether it is made (`library.made`) and no recording."""
        return self.path.startswith(MADE_FOLDER)

    @property
    def recording(self) -> Motion:
        """What of it was recorded."""
        return self.motion if self.recorded is None else self.motion.frames(0, self.recorded)

    def source_at(self, frame: float) -> str:
        """The file that shows `frame` (the clip's own rate), as a path below the library: the recording, or behind its
        end the file of the same frames that was made."""
        made = self.recorded is not None and frame > self.recorded - 1
        if not made:
            return self.path
        return LANDING_FOLDER + self.path + ("" if self.path.lower().endswith(".bvh") else ".bvh")

    @property
    def contacts(self) -> np.ndarray:
        """(T, 2) bool: left and right foot flat on the ground."""
        return self.standing.all(axis=2)

    def words_at(self, frame: float) -> frozenset[str]:
        """Words of every row that covers `frame` (the clip's own rate)."""
        return frozenset(word for row in self.annotations if row.start <= frame <= row.end for word in row.words)

    def twin(self) -> "Clip":
        """The same clip with left and right exchanged (Faustino §3.1.2), words too."""
        rows = tuple(replace(row, words=tuple(swap_sides(row.words))) for row in self.annotations)
        standing = self.standing[:, ::-1]
        return Clip(path=self.path, mirrored=not self.mirrored, motion=mirror(self.motion), annotations=rows,
                    standing=standing, recorded=self.recorded, mended=self.mended)
