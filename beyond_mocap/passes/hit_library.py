"""The hit motions of a library, and which of them resembles an example (Ball handling, section 4, eq. 2).

Every clip and its mirrored twin are analysed for both sides, so what one foot can do the other can do too. One distance
compares all hit motions: of the part's highest speed, of its displacements from pose to pose, and of how long each of
them takes. The example may come from another body: its speed and displacements are scaled to the library's size. The
heading of a hit motion does not matter here; `pass_choice` turns it, by any angle or in steps of 45 degrees.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..annotation.ball_contact import find_striking_part, may_use_several_parts
from ..annotation.striking import BODY_PARTS, SIDED_PARTS
from ..ball.contact import Tool
from ..base.digest import hex_digest
from ..library.clip import Clip
from ..library.library import Library
from . import analysis_cache as kept
from .hits import HitMotion, build_hit_at, detect_hits
from .pass_scene import KINDS

# m/s of the part between toss and pass, and between pass and attack (section 5 divides them by highest speed)
_KIND_SPEEDS = {"foot": (4.5, 7.5), "hand": (4.0, 7.0), "head": (2.0, 3.5), "chest": (1.0, 2.0), "tool": (8.0, 13.0)}
_LEAST_TOUCH_SPEED = 0.3  # m/s: least speed of a part whose labels say that it touches the ball


@dataclass(frozen=True)
class MatchWeights:
    """Weights of the terms of eq. 2.

    Attributes:
        speed: w_v, seconds: per m/s of difference in highest speed.
        vector: w_m: per metre of difference in displacement.
        time: w_t, m/s: per second of difference in duration.
    """

    speed: float = 0.1
    vector: float = 1.0
    time: float = 1.0


@dataclass(frozen=True, eq=False)
class LibraryHit:
    """A hit motion of a library.

    Attributes:
        clip: index of the clip in the library.
        hit: the hit motion, in the clip's own frames.
        is_labelled: whether the clip's labels name the moment; then the key is the labelled one.
    """

    clip: int
    hit: HitMotion
    is_labelled: bool


@dataclass(frozen=True, eq=False)
class HitLibrary:
    """All hit motions of one part, H of them, in the order of the clips.

    Attributes:
        part: part that strikes.
        hits: the hit motions.
    """

    part: str
    hits: tuple[LibraryHit, ...]

    @staticmethod
    def from_library(library: Library, part: str = "foot", tool: Tool | None = None) -> "HitLibrary":
        """Build or load the hit motions of all clips of a library.

        Where labels say what a clip shows, only what they call a touch of this part counts. Stored beside the library's
        cache.

        Args:
            library: the library.
            part: "foot", "head", "chest", "hand", "tool", or a joint's name.
            tool: what is in the hand.
        Returns:
            The hit motions.
        Raises:
            InputError: if the skeleton lacks the part.
        """
        name = f"hits_{hex_digest(repr((part, tool)))}"  # a digest, because joints may be called Head, or a/b
        arrays = kept.load_arrays(library, name)
        if arrays is not None:
            return HitLibrary(part, _from_arrays(part, arrays))
        found = [one for index, clip in enumerate(library.clips) for one in _find_hits_of_clip(index, clip, part, tool)]
        named = [one for one in found if _is_labelled_touch(library.clips[one.clip], one.hit)]
        hit_library = HitLibrary(part, tuple(named or found))
        kept.save_arrays(library, name, _to_arrays(hit_library.hits))
        return hit_library

    def __len__(self) -> int:
        return len(self.hits)

    @cached_property
    def _hit_arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Sizes (H,) m, highest speeds (H,) m/s, displacements (H, 4, 3) m and times (H, 4) s."""
        hits = [one.hit for one in self.hits]
        return (np.array([hit.size for hit in hits]), np.array([hit.max_speed for hit in hits]),
                np.array([hit.vectors for hit in hits]).reshape(-1, 4, 3),
                np.array([hit.times for hit in hits]).reshape(-1, 4))

    @cached_property
    def sides(self) -> np.ndarray:
        """Side of each hit, (H,): "left", "right" or ""."""
        return np.array([one.hit.side for one in self.hits], dtype="<U5")

    @property
    def speeds(self) -> np.ndarray:
        """Highest speed of the part in each hit, (H,) m/s."""
        return self._hit_arrays[1]

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """Kind of each hit, toss, pass or attack, by its highest speed (section 5)."""
        return tuple(KINDS[int(np.searchsorted(_kind_speeds(self.part), speed, "right"))] for speed in self.speeds)

    def sort_by_similarity(self, example: HitMotion, weights: MatchWeights = MatchWeights(),
                           side: str | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Compute how much each hit motion differs from an example (eq. 2), and sort them.

        Displacements are compared in each body's own frame, so headings do not matter. Those that an example under way
        has not come to (NaN) are left out.

        Args:
            example: the example, of a body of any size.
            weights: weights of eq. 2.
            side: only hit motions of this side; None: all.
        Returns:
            order: (K,) indices into `hits`, most similar first.
            distance: (H,) m.
        Source: Ball handling, section 4, eq. 2.
        """
        size, speed, vectors, times = self._hit_arrays
        # scale from the example's body to the library's, by leg length
        scale = size / max(example.size, 1e-6)
        distance = weights.speed * np.abs(speed - scale * example.max_speed)
        difference = vectors - scale[:, None, None] * example.vectors
        distance += weights.vector * np.nansum(np.sqrt(np.einsum("hik,hik->hi", difference, difference)), axis=1)
        distance += weights.time * np.nansum(np.abs(times - example.times), axis=1)
        order = np.argsort(distance, kind="stable")
        return (order if side is None else order[self.sides[order] == side]), distance

    def sort_by_kind(self, kind: str, side: str | None = None) -> np.ndarray:
        """Sort the hits by how well they suit a toss, a pass or an attack.

        First come those whose speed lies within the kind's range, then those nearest to it. Within the range come first
        those that labels name, then those nearest to its middle (for attacks the fastest).

        Args:
            kind: "toss", "pass" or "attack".
            side: only hit motions of this side; None: all.
        Returns:
            (K,) indices into `hits`, best first.
        """
        edges = (0.0, *_kind_speeds(self.part), np.inf)
        low, high = edges[KINDS.index(kind)], edges[KINDS.index(kind) + 1]
        # m/s by which each hit misses the kind's speed range
        outside = np.maximum(low - self.speeds, 0.0) + np.maximum(self.speeds - high, 0.0)
        unnamed = np.array([not one.is_labelled for one in self.hits], dtype=bool)
        typical = np.abs(self.speeds - 0.5 * (low + high)) if np.isfinite(high) else -self.speeds
        # last key first: range, then labels, then typical speed, then the order of clips
        order = np.lexsort((np.arange(len(self)), typical, unnamed, outside))
        return order if side is None else order[self.sides[order] == side]


def classify_hit(hit: HitMotion) -> str:
    """Classify a hit motion as toss, pass or attack by the part's highest speed (section 5)."""
    return KINDS[int(np.searchsorted(_kind_speeds(hit.part), hit.max_speed, "right"))]


def _kind_speeds(part: str) -> tuple[float, float]:
    return _KIND_SPEEDS.get(part, _KIND_SPEEDS["foot"])


def _find_hits_of_clip(index: int, clip: Clip, part: str, tool: Tool | None) -> list[LibraryHit]:
    """Find the hit motions of one clip, with labelled keys where there are labels, in order of time."""
    if len(clip.recording) < 3:
        return []
    sides = ("left", "right") if part in SIDED_PARTS else ("",)
    hits = [hit for side in sides for hit in detect_hits(clip.recording, part, side, tool=tool).motions]
    found = [_apply_label(index, clip, hit) for hit in hits]
    found += [LibraryHit(index, hit, True) for hit in _build_labelled_hits(clip, part, sides, hits, tool)]
    return sorted(found, key=lambda one: one.hit.first)


def _apply_label(index: int, clip: Clip, hit: HitMotion) -> LibraryHit:
    """Build a library hit, with the labelled key where the clip's labels name a touch of this part within it."""
    for row in clip.annotations:
        if row.key is not None and hit.first < row.key < hit.last and _has_touch_label(row.words, hit.part, hit.side):
            return LibraryHit(index, replace(hit, key=int(round(row.key))), True)
    return LibraryHit(index, hit, False)


def _build_labelled_hits(clip: Clip, part: str, sides, hits: list[HitMotion], tool: Tool | None) -> list[HitMotion]:
    """Build hit motions for labelled touches that the analysis does not see: a trap is slow, a header may need no jump.

    Where the labels name no side, the faster side is taken.
    """
    found = []
    for row in clip.annotations:
        if row.key is None or any(hit.first < row.key < hit.last and _has_touch_label(row.words, part, hit.side)
                                  for hit in hits):
            continue
        named = [side for side in sides if _has_touch_label(row.words, part, side)]
        candidates = [build_hit_at(clip.recording, int(round(row.key)), _frames_around(row, clip), part=part, side=side,
                                   tool=tool) for side in named]
        found += [hit for hit in sorted(candidates, key=lambda hit: -hit.max_speed)[:1] if hit.max_speed
                  > _LEAST_TOUCH_SPEED]
    return found


def _frames_around(row, clip: Clip) -> tuple[int, int]:
    """Compute the first and last frame of a touch: its row, at most a second before and after its key."""
    reach = clip.motion.fps
    return int(max(row.start, row.key - reach)), int(min(row.end, row.key + reach))


def _has_touch_label(labels, part: str, side: str) -> bool:
    """Whether labels name a touch of this part and side."""
    sides = {"left", "right"} & set(labels) if part in ("foot", "hand") else set()
    return find_striking_part(labels) == part and (not sides or side in sides)


def _is_labelled_touch(clip: Clip, hit: HitMotion) -> bool:
    """Whether the clip's labels call this a touch of the part.

    Where no row covers the hit, all rows of the clip count. Labels do not know tools and joints, so those always pass.
    """
    if hit.part not in BODY_PARTS:
        return True
    rows_at_key = [row.words for row in clip.annotations if row.start <= hit.key <= row.end]
    rows = rows_at_key or [row.words for row in clip.annotations]
    juggles = any(may_use_several_parts(labels, hit.part) for labels in rows)
    return juggles or any(_has_touch_label(labels, hit.part, hit.side) for labels in rows)


# fields of HitMotion that are stored: whole numbers, numbers, arrays
_INTEGER_FIELDS = ("first", "last", "high", "key")
_NUMBER_FIELDS = ("max_speed", "facing", "size", "fps")
_ARRAY_FIELDS = ("vectors", "times", "velocity", "fasts")


def _to_arrays(hits: tuple[LibraryHit, ...]) -> dict[str, np.ndarray]:
    """Convert hit motions to arrays that can be stored."""
    arrays = {name: np.array([getattr(one.hit, name) for one in hits]) for name in (*_INTEGER_FIELDS, *_NUMBER_FIELDS,
                                                                                    *_ARRAY_FIELDS)}
    arrays["clip"], arrays["labelled"] = np.array([one.clip for one in hits]), np.array([one.is_labelled
            for one in hits])
    arrays["side"] = np.array([one.hit.side for one in hits], dtype="<U5")
    return arrays


def _from_arrays(part: str, arrays: dict[str, np.ndarray]) -> tuple[LibraryHit, ...]:
    """Build hit motions from stored arrays."""
    found = []
    for row in range(len(arrays["clip"])):
        values: dict[str, Any] = {name: int(arrays[name][row]) for name in _INTEGER_FIELDS}
        values |= {name: float(arrays[name][row]) for name in _NUMBER_FIELDS}
        values |= {name: arrays[name][row] for name in ("vectors", "times", "velocity")}
        fasts = tuple(int(frame) for frame in arrays["fasts"][row])
        hit = HitMotion(part=part, side=str(arrays["side"][row]), fasts=fasts, **values)
        found.append(LibraryHit(int(arrays["clip"][row]), hit, bool(arrays["labelled"][row])))
    return tuple(found)
