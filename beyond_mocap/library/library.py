"""A library: the clips of a folder, a mirrored twin of each, their words, features, clusters and key moments.

`build` reads a folder once and keeps what it worked out in a cache (`library.cache`); the next call is quick.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Callable

import numpy as np

from ..annotation import LOCOMOTION, ClipAnnotation, recorded_thresholds
from ..annotation.gaits import STANDING
from ..annotation.vocabulary import DIRECTIONS
from ..base.errors import InputError
from ..motion.skeleton import Skeleton
from . import cache
from .cache import write_synthetic_clips
from .clip import Clip
from .clusters import Clusters
from .features import FPS, Frames, describe_clips, joined
from .keys import Key, keys_of
from .made import KICK, TAKE, TAKES_FROM, gaps, locomotion, made_clips, touch_speed

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Gait:
    """A kind of locomotion of the library: its word, all words of its most common row, and mean speed in m/s."""

    word: str
    words: tuple[str, ...]
    speed: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Library:
    """Everything a search needs. `frames`: all clips at `fps` (30); `clusters` by block length; notes: what was
    decided; kept: where its cache is and under which key, for what is worked out later; chosen: which clip stands for
    which gait, (word, path) pairs (`library.automatic`)."""

    folder: str
    skeleton: Skeleton
    clips: tuple[Clip, ...]
    frames: Frames
    clusters: dict[int, Clusters]
    fps: float = FPS
    notes: tuple[str, ...] = ()
    kept: tuple[Path, str] | None = None
    chosen: tuple[tuple[str, str], ...] = ()

    @cached_property
    def keys(self) -> tuple[Key, ...]:
        """Key moments of all clips."""
        return keys_of(self.clips)

    @cached_property
    def words(self) -> frozenset[str]:
        """Every word that a clip carries."""
        return frozenset(word for clip in self.clips for row in clip.annotations for word in row.words)

    @cached_property
    def gaits(self) -> tuple[Gait, ...]:
        """The library's own locomotion from slow to fast; InputError where it has none."""
        return measure_gaits(self)

    @cached_property
    def gait_thresholds(self) -> np.ndarray:
        """(G-1,) m/s: where the clips' own annotations change from each gait to the next faster one."""
        frames, gaits = self.frames, self.gaits
        column = {word: i for i, word in enumerate(frames.vocabulary)}
        labelled = np.full(len(frames), -1)
        for number, gait in enumerate(gaits):
            labelled[frames.words[:, column[gait.word]]] = number
        return recorded_thresholds(np.array([gait.speed for gait in gaits]), frames.speed, labelled)

    @cached_property
    def stance_seconds(self) -> np.ndarray:
        """(N,) seconds that the foot which leaves the ground sooner stands there in all at each frame; 0 while one is
        in the air. Whoever plays it faster or slower than the track drags that foot as long."""
        return np.concatenate([_stance_seconds(clip, self._own_frames(i)) for i, clip in enumerate(self.clips)])

    @cached_property
    def feet_standing(self) -> np.ndarray:
        """(N, 2) bool: left and right foot on the ground, heel or toe."""
        stands = (clip.standing.any(axis=2)[_nearest(clip, self._own_frames(i))] for i, clip in enumerate(self.clips))
        return np.concatenate(list(stands))

    def _own_frames(self, clip: int) -> np.ndarray:
        first = self.frames.first[clip]
        return self.frames.source[first : first + self.frames.count[clip]]

    @cached_property
    def extended(self) -> "Library":
        """The recordings and, behind them, what `library.made` makes of them: the speeds between and above them, and
        kicks and taken balls on the run; made on first use and kept beside the cache. It has no clusters. InputError
        where no recording shows locomotion."""
        measure_gaits(self)  # a library without locomotion stays an error
        found = cache.load(*self.kept, "made") if self.kept else None
        made = Library(folder="", **found) if found else None
        if made is None:
            made = _made(self)
            if self.kept:
                write_synthetic_clips(self.kept[0], made.clips)
                cache.save(*self.kept, made, "made")
        else:
            write_synthetic_clips(self.kept[0], made.clips, missing_only=True)
        if not made.clips:
            return self
        frames = joined(self.frames, made.frames)
        return replace(self, clips=(*self.clips, *made.clips), frames=frames, clusters={})

    @cached_property
    def gaps(self) -> tuple[tuple[float, float], ...]:
        """(from, to) m/s of the speeds that recorded locomotion does not reach."""
        return gaps(self.frames.speed[locomotion(self.frames, self.clips)], self.fps)

    def lacks(self, speed: np.ndarray, at_keys: np.ndarray, takes: np.ndarray) -> bool:
        """Whether a track at `speed` (T,) m/s, at the library's rate, stays in a gap for a fifth of a second or more,
        or has key moments, at `at_keys` (K,) m/s, that are faster than any recorded kick, or, where one `takes` (K,)
        bool the ball, any recorded taking of a ball with the foot, can be played without sliding."""
        inside = sum(int(np.sum((speed > low) & (speed < high))) for low, high in self.gaps)
        kick, take = (touch_speed(self.frames, self.clips, self.keys, act) for act in (KICK, TAKE))
        too_fast = 1.3 * np.where(takes & np.isfinite(take), max(take, TAKES_FROM), kick)
        return inside >= 0.2 * self.fps or bool(np.any(at_keys > too_fast))

    @cached_property
    def fastest(self) -> float:
        """m/s: the highest speed that a clip reaches."""
        return float(self.frames.speed.max())

    @property
    def minutes(self) -> float:
        """Recorded minutes, twins not counted."""
        return sum(clip.motion.duration for clip in self.clips if not clip.mirrored) / 60.0


def _made(library: Library) -> Library:
    """What the recordings lack (`library.made`), described like them."""
    speeds = {gait.word: gait.speed for gait in library.gaits if gait.word != STANDING}
    clips = []
    for made in made_clips(library.clips, library.frames, library.fps, speeds, library.keys):
        clip = Clip(path=made.name, mirrored=False, motion=made.motion, annotations=made.rows, standing=made.standing)
        clips += [clip, clip.twin()]
    if not clips:
        return replace(library, clips=())
    frames = describe_clips(clips, library.frames)
    return replace(library, clips=tuple(clips), frames=frames, clusters={}, notes=())


def _stance_seconds(clip: Clip, source: np.ndarray) -> np.ndarray:
    """(T,) of one clip at its frames `source` (T,)."""
    stands = clip.standing.any(axis=2)
    length = np.stack([_run_lengths(stands[:, side]) for side in (0, 1)], axis=1).min(axis=1) / clip.motion.fps
    return length[_nearest(clip, source)]


def _nearest(clip: Clip, source: np.ndarray) -> np.ndarray:
    """(T,) the clip's whole frames nearest to `source` (T,)."""
    return np.clip(np.round(source).astype(int), 0, len(clip.standing) - 1)


def _run_lengths(flags: np.ndarray) -> np.ndarray:
    """(T,) length of the run of True that each frame lies in, 0 for False."""
    edges = np.flatnonzero(np.diff(flags, prepend=not flags[0], append=not flags[-1]))
    lengths = np.diff(edges)
    return np.repeat(lengths, lengths) * flags


def measure_gaits(library: Library) -> tuple[Gait, ...]:
    """Speeds of the library's locomotion (Faustino §3.1.1): per gait word, distance over time of its most common rows.

    A gait without a direction in its words counts as well as one with; rows of key moments and dribbles do not count,
    nor do made clips of a gait that is recorded, nor other clips than the chosen one, nor rows that a slower one would
    overtake in the mean (then the word is dropped, since thresholds need an order)."""
    seconds: dict[str, Any] = {word: Counter() for word in LOCOMOTION}
    metres: dict[str, Any] = {word: Counter() for word in LOCOMOTION}
    frames = library.frames
    step = np.linalg.norm(np.diff(frames.path, axis=0), axis=1)
    chosen = dict(library.chosen)
    recorded = {word for clip in library.clips if not clip.made for row in clip.annotations for word in row.words}
    for index, clip in enumerate(library.clips):
        first, rate = frames.first[index], library.fps / clip.motion.fps
        for row in () if clip.mirrored else clip.annotations:
            word = gait_word(row)
            if word is None or (clip.made and word in recorded) or chosen.get(word, clip.path) != clip.path:
                continue
            low, high = first + int(np.ceil(row.start * rate)), first + int(row.end * rate)
            seconds[word][row.words] += (row.end - row.start) / clip.motion.fps
            metres[word][row.words] += float(step[low:high].sum())
    found = []
    for word, times in seconds.items():
        if times:
            words = max(times, key=lambda w: (times[w], w))
            found.append(Gait(word, words, metres[word][words] / max(times[words], 1e-9)))
    if not any(gait.word != STANDING for gait in found):
        raise InputError(
            library.folder, "no locomotion clip", "clips annotated walking, jogging, running or sprinting",
            "annotate which clips are locomotion",
        )
    ordered = [gait for i, gait in enumerate(found) if all(gait.speed > other.speed for other in found[:i])]
    return tuple(ordered)


def gait_word(row: ClipAnnotation) -> str | None:
    """The gait that a row shows and nothing else, but for a direction; None of a key moment, an action or a dribble."""
    words = [word for word in row.words if word in LOCOMOTION]
    alone = row.key is None and len(words) == 1 and not set(row.words) - {words[0], *DIRECTIONS}
    return words[0] if alone else None

