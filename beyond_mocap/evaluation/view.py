"""What all figures of one report share: the take, the frames of the library it used, its seams, its speed, what was
asked."""

from __future__ import annotations

import numpy as np

from ..annotation import Timeline
from ..base.errors import InputError
from ..library.library import Library
from ..motion.humanoid import stature
from ..motion.skeleton import Skeleton
from ..motion.track import Track
from ..synthesis.quality import movement
from ..synthesis.quality.moments import moments
from ..synthesis.quality.played import Played, find_transitions
from .reference import library_reference


class View:
    """What all figures of one report share, worked out once."""

    def __init__(self, played: Played, track: Track | None, timeline: Timeline | None, library: Library | None):
        motion = played.motion
        self.played, self.timeline, self.library, self.track = played, timeline, library, track
        self.fps, self.count = motion.fps, len(motion)
        self.reference = None if library is None else library_reference(library, motion.fps)
        self.size = 1.0 if library is None else _size(motion.skeleton, library.skeleton)
        self.stride = played.stride(library)
        self.rows = self._rows()
        self.used = np.rint(self.rows[np.isfinite(self.rows)]).astype(int)
        self.seams = find_transitions(*self.source)
        self.speed = movement.travel_speed(played.pelvis, self.fps)
        self.wanted = None if track is None else movement.track_at(track, played.times)
        self.moments = [] if timeline is None else moments(played, timeline.keys, self.stride, library)

    @property
    def source(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Clip, mirrored, clip_frame and stride per frame, as `find_transitions` takes them."""
        return self.played.clip, self.played.mirrored, self.played.clip_frame, self.stride

    def own(self, name: str) -> np.ndarray:
        """A figure of the uncut recordings at the frames that were used: (U, ...), empty without library."""
        return np.zeros(0) if self.reference is None else getattr(self.reference, name)[self.used]

    def _rows(self) -> np.ndarray:
        if self.reference is None:
            return np.full(self.count, np.nan)
        return self.reference.rows(self.played.clips, self.played.clip, self.played.clip_frame)


def _size(skeleton: Skeleton, library: Skeleton) -> float:
    """How many times as tall as the library's skeleton another one is; InputError where it is not the same one."""
    if skeleton.same_bones(library, 5e-3):
        return 1.0
    size = stature(skeleton) / stature(library) if skeleton.names == library.names else 1.0
    if not skeleton.same_bones(library.scaled(size), 5e-3):
        raise InputError("motion", "another skeleton than the library's", "a motion made from this library")
    return size
