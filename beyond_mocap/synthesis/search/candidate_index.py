"""Candidates of the path search that depend only on the library: computed once and cached with it."""

from __future__ import annotations

import weakref
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from ...annotation import CONTINUOUS, DISCRETE
from ...annotation.ball_contact import SENDING
from ...annotation.gaits import TURNING
from ...annotation.labels import list_gaits, list_labels
from ...base.time_series import compute_running_maximum
from ...base.vectors import arctan2
from ...library import cache
from ...library.library import Library
from ..quality.movement import JERK_REACH, classify_speed
from .block_costs import AnnotationCost

STAND_SPEED = 0.2  # m/s that a clip of a stand never exceeds

SLOT = 8  # output frames of a usual slot
PLAYBACK_RATES = np.array([0.875, 0.9375, 1.0, 1.0625, 1.125])  # playback rates that are tried
MOST_STRANGE = 3.0  # radii beyond the region of normal locomotion at which the cost stops growing
_SHOWN_FASTEST = int(np.ceil(SLOT * PLAYBACK_RATES[-1]))  # library frames that a usual slot shows at most
BUCKET = 40  # library frames that count as one for replayed stretches
USUAL_STANCE = 0.3  # s with both feet on the ground, in a walk
_LONGEST_STANCE = 2.0  # s beyond the usual stance at which its cost stops growing
ACTING = CONTINUOUS - {TURNING, *list_gaits(), *list_labels(ball="carries")}
"""Labels of what a body does for a while besides going, turning and carrying the ball; synthetic clips show it only
where it is requested (recordings of it are judged by their posture)."""
STRIKE_COST = 4.0
"""How many times as much labels of a ball that is struck cost as other actions that are not requested: a kick
without a ball is the last thing to fill a run with."""

_STORED = ("is_synthetic", "strange", "recording", "is_made_travel", "speed", "turn", "valid", "by_speed", "offset",
           "long_stance", "is_in_contact", "lifted", "lean", "wild_before", "wild_after")  # fmt: skip
"""Arrays of an index that are stored beside the library's cache."""
_PAIR = "pair_"

_SHOWN = 14  # library frames that a long slot shows at the fastest playback rate


@dataclass(frozen=True, eq=False)
class RatePairs:
    """K pairs of a playback rate and a library frame at which a slot may begin.

    Attributes:
        number: (K,) index of the playback rate.
        frame: (K,) library frame.
        speed: (K,) m/s over the slot.
        turn: (K,) rad over the slot.
        offset: (K,) rad from the direction of travel to the facing.
        long_stance: (K,) s of contact of both feet beyond that of a walk.
        lifted: (K,) share of the slot without both feet on the ground.
        lean: (K, 2) slopes ahead and to the left of the travel, over the slot; by column in memory, as they are read.
    """

    number: np.ndarray
    frame: np.ndarray
    speed: np.ndarray
    turn: np.ndarray
    offset: np.ndarray
    long_stance: np.ndarray
    lifted: np.ndarray
    lean: np.ndarray

    def select_pairs(self, which: slice) -> "RatePairs":
        """Select a slice of the pairs."""
        return RatePairs(*(values[which] for values in vars(self).values()))


class CandidateIndex:
    """What N library frames at R playback rates have for a slot that begins there.

    Attributes:
        frames: the library's frames.
        annotation: their annotation costs.
        speed: (R, N) m/s over a slot.
        turn: (R, N) rad over a slot.
        valid: (R, N) bool, whether the clip lasts that long and is allowed.
        by_speed: (K,) the valid pairs, flat indices into (R, N), in order of their speeds.
        offset, long_stance, lifted, lean: (N, ...), see `RatePairs`.
        is_synthetic: (N,) bool, frames of synthetic clips.
        strange: (N,) float32, how far outside of normal locomotion a slot from there on is, up to MOST_STRANGE.
        recording: (N,) int, the same for a clip and its mirrored twin.
        is_in_contact: (N, 2) bool, feet in contact.
        wild_before, wild_after: (N,), see `measure_wildness`.
        bucket: (N,) int; frames of one bucket look alike when they are shown twice.
    """

    _cached: weakref.WeakKeyDictionary[Library, dict[bytes, "CandidateIndex"]] = weakref.WeakKeyDictionary()

    @classmethod
    def for_library(cls, library: Library, allowed: np.ndarray) -> "CandidateIndex":
        """Return the cached index of a library for the clips of `allowed` (C,) bool, built on first use."""
        cached = cls._cached.setdefault(library, {})
        if allowed.tobytes() not in cached:
            cached[allowed.tobytes()] = cls(library, allowed)
        return cached[allowed.tobytes()]

    def __init__(self, library: Library, allowed: np.ndarray):
        """Build the index, or map the one that an earlier run left beside the library's cache; `for_library` does so
        only once.
        """
        self.frames = library.frames
        self.annotation = AnnotationCost(library.frames)
        self.bucket = (np.arange(len(library.frames)) // BUCKET).astype(int)
        self._by_words: dict[frozenset[str], tuple[np.ndarray, np.ndarray]] = {}
        self._sorted: dict[frozenset[str], RatePairs] = {}
        self._showing: dict[frozenset[str], np.ndarray] = {}
        place = library.index_place if allowed.all() else None
        known = cache.load_arrays(*place) if place else None
        if known is None or set(known) != {*_STORED, *_list_pair_names()} or len(known["strange"]) != len(self.frames):
            base = library.base_library
            known_part = None if base is None else CandidateIndex.for_library(base, allowed[: len(base.clips)])
            self._compute(library, allowed, known_part)
            if place:
                cache.save_arrays(*place, self._list_arrays())
        else:
            vars(self).update({name: known[name] for name in _STORED})
            self._sorted[frozenset()] = RatePairs(*(np.asfortranarray(known[name]) for name in _list_pair_names()))

    def _list_arrays(self) -> dict[str, np.ndarray]:
        """List the arrays that are stored, with all pairs in order of their speeds."""
        pairs = self.pairs_by_speed()
        stored = {name: getattr(self, name) for name in _STORED}
        return {**stored, **{name: getattr(pairs, name.removeprefix(_PAIR)) for name in _list_pair_names()}}

    def _compute(self, library: Library, allowed: np.ndarray, known: "CandidateIndex | None") -> None:
        """Compute what depends on the clips; `known` is the index of the library that this one extends."""
        from scipy.ndimage import uniform_filter1d

        self.is_synthetic = np.array([clip.is_synthetic for clip in library.clips])[library.frames.clip]
        strange = compute_running_maximum(library.strangeness, 0, SLOT - 1)
        self.strange = np.clip(strange - 1.0, 0.0, MOST_STRANGE)
        recording = np.unique([clip.path for clip in library.clips], return_inverse=True)[1]
        self.recording = recording[library.frames.clip]
        fastest = np.maximum.reduceat(library.frames.speed, library.frames.first)
        # a recorded stand that is played forward and backward costs nothing; the ends of a synthetic turn are no stand
        self.is_made_travel = self.is_synthetic & (fastest[library.frames.clip] > STAND_SPEED)
        self.offset = -arctan2(self.frames.velocity[:, 1], self.frames.velocity[:, 0]).astype(np.float32)
        self.long_stance = np.clip(library.stance_seconds - USUAL_STANCE, 0.0, _LONGEST_STANCE).astype(np.float32)
        self.is_in_contact = library.feet_in_contact
        lifted = (~self.is_in_contact.all(axis=1)).astype(np.float32)
        self.lifted = uniform_filter1d(lifted, SLOT, origin=-(SLOT // 2), mode="nearest")
        self.lean = uniform_filter1d(library.frames.lean, SLOT, axis=0, origin=-(SLOT // 2), mode="nearest")
        self.wild_before, self.wild_after = measure_wildness(library)
        self._compute_pairs(library, allowed, known)

    def _compute_pairs(self, library: Library, allowed: np.ndarray, known: "CandidateIndex | None") -> None:
        """Compute what the playback rates make of frames, and the order of their speeds."""
        count = 0 if known is None else len(known.frames)
        speed, turn, lasts = map(np.stack, zip(*(compute_speed_and_turn(library, rate, count)
                                                 for rate in PLAYBACK_RATES)))
        self.speed, self.turn = speed.astype(np.float32), turn.astype(np.float32)
        is_t_pose = compute_running_maximum(library.shows_t_pose, 0, _SHOWN_FASTEST)
        self.valid = lasts & (allowed[library.frames.clip] & ~is_t_pose)[count:]
        usable = np.flatnonzero(self.valid)
        number, frame = np.divmod(usable[np.argsort(self.speed.ravel()[usable], kind="stable")], speed.shape[1])
        self.by_speed = number * len(self.frames) + frame + count
        if known is not None:
            self.speed, self.turn, self.valid = (np.concatenate([getattr(known, name), getattr(self, name)], axis=1)
                                                 for name in ("speed", "turn", "valid"))
            self._merge_pairs(known, number, frame + count)

    def _merge_pairs(self, known: "CandidateIndex", number: np.ndarray, frame: np.ndarray) -> None:
        """Merge pairs (K,) in order of their speeds into those of the index of the first frames."""
        pairs, added = known.pairs_by_speed(), self.build_pairs(number.astype(np.int8), frame.astype(np.int32))
        at = np.searchsorted(known.speed_order, _order_by_speed(added), side="right")
        self._sorted[frozenset()] = RatePairs(*(np.insert(old, at, new, axis=0)
                                                for old, new in zip(vars(pairs).values(), vars(added).values())))
        merged = self._sorted[frozenset()]
        self.by_speed = merged.number.astype(int) * len(self.frames) + merged.frame

    @cached_property
    def speed_order(self) -> np.ndarray:
        """(K,) int, ascending: the place of each pair of `by_speed` by speed, among equals by playback rate."""
        return _order_by_speed(self.pairs_by_speed())

    def round_frame(self, frame: np.ndarray) -> np.ndarray:
        """Round to the nearest whole library frames."""
        return np.minimum(np.maximum(np.rint(frame).astype(int), 0), len(self.frames) - 1)

    def build_pairs(self, number: np.ndarray, frame: np.ndarray) -> RatePairs:
        """Build the pairs of PLAYBACK_RATES[number (K,)] and library frame (K,)."""
        pair = number.astype(np.intp) * len(self.frames) + frame
        played = self.speed.ravel().take(pair), self.turn.ravel().take(pair)
        return RatePairs(number, frame, *played, self.offset.take(frame), self.long_stance.take(frame),
                         self.lifted.take(frame), np.asfortranarray(self.lean.take(frame, axis=0)))

    def pairs_by_speed(self, avoid: frozenset[str] = frozenset()) -> RatePairs:
        """Return all valid pairs in order of their speeds, without those that show a label of `avoid` unless all do."""
        if avoid not in self._sorted:
            # flat index = rate * N + frame, so `% N` is the frame
            fine = ~self.shows_labels(avoid)[self.by_speed % len(self.frames)]
            selected = self.by_speed[fine] if avoid and fine.any() else self.by_speed
            number, frame = np.divmod(selected, len(self.frames))
            self._sorted[avoid] = self.build_pairs(number.astype(np.int8), frame.astype(np.int32))
        return self._sorted[avoid]

    def shows_labels(self, words: frozenset[str]) -> np.ndarray:
        """Return (N,) bool: a slot from there on shows one of the labels."""
        if words not in self._showing:
            carried = self.annotation.find_frames_with(words)
            self._showing[words] = compute_running_maximum(carried, 0, _SHOWN - 1)
        return self._showing[words]

    def measure_lacking(self, words: frozenset[str]) -> tuple[np.ndarray, np.ndarray]:
        """Compute what frames lack of requested labels (none: all will do).

        Args:
            words: the labels.
        Returns:
            (N,) share of them that each frame lacks; (N,) 1 where a slot from there on shows an action (a jump) that is
            not requested, or nothing that is annotated, STRIKE_COST where it strikes a ball without a request, else 0.
        """
        if words not in self._by_words:
            names, frames = self.frames.vocabulary, self.frames
            missing = self.annotation.compute_missing_share(words) if words else np.zeros(len(frames))
            if ACTING & words:  # a slot that begins with the last frame of an action does not show it
                from scipy.ndimage import uniform_filter1d

                missing = uniform_filter1d(missing, SLOT, origin=-(SLOT // 2), mode="nearest")
            actions, spans = ([i for i, word in enumerate(names) if word in kind and word not in words]
                              for kind in (DISCRETE, ACTING))
            acts = frames.words[:, actions].any(axis=1) | (frames.words[:, spans].any(axis=1) & self.is_synthetic)
            strikes = frames.words[:, [i for i, word in enumerate(names) if word in SENDING - words]].any(axis=1)
            shown = np.where(strikes, STRIKE_COST, acts)
            lacking = np.maximum(compute_running_maximum(shown, 0, SLOT), ~frames.words.any(axis=1))
            self._by_words[words] = missing.astype(np.float32), lacking.astype(np.float32)
        return self._by_words[words]


def _order_by_speed(pairs: RatePairs) -> np.ndarray:
    """Order pairs (K,) by whole numbers: their speeds, whose bits grow with them, then the playback rate."""
    return (pairs.speed + np.float32(0.0)).view(np.int32).astype(np.int64) * len(PLAYBACK_RATES) + pairs.number


def _list_pair_names() -> list[str]:
    """List the names under which the pairs in order of their speeds are stored."""
    return [_PAIR + field.name for field in fields(RatePairs)]


def measure_wildness(library: Library) -> tuple[np.ndarray, np.ndarray]:
    """Compute by how much the largest jerk around each frame exceeds what is usual at its speed.

    The jerk of a transition is measured over such windows (docs/explanation/quality.md).

    Returns:
        (N,) and (N,) for the JERK_REACH frames before and after each frame, as a share; 0 where it does not exceed it.
    """
    from scipy.ndimage import maximum_filter1d

    frames = library.frames
    kind = classify_speed(frames.speed)
    around = maximum_filter1d(frames.jerk, 2 * JERK_REACH + 1, mode="nearest")
    # 90th percentile in the speed class; inf where the library has no frame of the class
    usual = np.array([np.percentile(around[kind == k], 90) if np.any(kind == k) else np.inf for k in range(5)])
    windows = (maximum_filter1d(frames.jerk, JERK_REACH + 1, mode="nearest", origin=o * (JERK_REACH // 2))
               for o in (1, -1))
    return tuple(np.maximum(window / usual[kind] - 1.0, 0.0).astype(np.float32) for window in windows)


def compute_speed_and_turn(library: Library, rate: float, first: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute what a slot plays if it starts at each library frame.

    Args:
        library: the clips, N frames.
        rate: playback rate.
        first: frames that are left out.
    Returns:
        (N - first,) mean speed m/s, turn of the body rad, and whether the clip lasts that long.
    """
    frames, at = library.frames, np.arange(first, len(library.frames))
    after = at + SLOT * rate
    valid = frames.remaining_in_clip[first:] >= SLOT * rate
    low = np.minimum(np.floor(after).astype(int), len(frames) - 2)
    weight = after - low
    # keep indices inside the library where the clip ends too soon; `valid` excludes them
    weight[~valid] = 0.0
    low[~valid] = np.minimum(at[~valid], len(frames) - 2)
    path = frames.path[low] * (1 - weight)[:, None] + frames.path[low + 1] * weight[:, None]
    heading = frames.heading[low] * (1 - weight) + frames.heading[low + 1] * weight
    speed = np.linalg.norm(path - frames.path[first:], axis=1) * library.fps / SLOT
    return speed, heading - frames.heading[first:], valid
