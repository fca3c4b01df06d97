"""The hit motions of a library, and which of them resembles an example (Ball handling §4 eq. 2).

Every clip and its mirrored twin are analysed for either side, so that what one foot can do the other can do too. All
hit motions go by one distance: of the part's greatest speed, of its way from pose to pose, and of how long each part of
the way takes. The example may be of another body: its speed and ways are taken in the library's size. Which way a hit
motion is turned about the vertical does not matter here; `pass_choice` does that, by any angle or in steps of 45
degrees.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..annotation.ball_contact import may_use_several, striking_part
from ..annotation.striking import BODY_PARTS
from ..ball.contact import Tool
from ..base.digest import hex_digest
from ..library.clip import Clip
from ..library.library import Library
from . import kept
from .hits import HitMotion, analyse, hit_at

KINDS = ("toss", "pass", "attack")
# m/s of the part between toss and pass, and between pass and attack (§5: told apart by the greatest speed)
_BOUNDS = {"foot": (4.5, 7.5), "hand": (4.0, 7.0), "head": (2.0, 3.5), "chest": (1.0, 2.0), "tool": (8.0, 13.0)}
_MOVES = 0.3  # m/s: the least of a part that is said to touch the ball


@dataclass(frozen=True)
class MatchWeights:
    """How much each part of eq. 2 counts: seconds by which a difference of greatest speed is weighed (w_v), the weight
    of the ways in metres (w_m), and m/s by which differences of time are weighed (w_t)."""

    speed: float = 0.1
    vector: float = 1.0
    time: float = 1.0


@dataclass(frozen=True, eq=False)
class LibraryHit:
    """A hit motion of a library: the clip's index, the hit motion in the clip's own frames, and whether the clip's
    words name the moment; then that is its key."""

    clip: int
    hit: HitMotion
    labelled: bool


@dataclass(frozen=True, eq=False)
class HitLibrary:
    """All hit motions of one part, H of them, in the order of the clips."""

    part: str
    hits: tuple[LibraryHit, ...]

    @staticmethod
    def of(library: Library, part: str = "foot", tool: Tool | None = None) -> "HitLibrary":
        """The hit motions of all clips of a library; kept beside its cache. Where words say what a clip shows, only
        what they call a touch of this part counts. InputError for a part that the skeleton lacks."""
        name = f"hits_{hex_digest(repr((part, tool)))}"  # joints may be called Head, or a/b
        arrays = kept.load(library, name)
        if arrays is not None:
            return HitLibrary(part, _restored(part, arrays))
        found = [one for index, clip in enumerate(library.clips) for one in _of_clip(index, clip, part, tool)]
        named = [one for one in found if _told(library.clips[one.clip], one.hit)]
        made = HitLibrary(part, tuple(named or found))
        kept.save(library, name, _stored(made.hits))
        return made

    def __len__(self) -> int:
        return len(self.hits)

    @cached_property
    def _arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Size (H,) m, greatest speed (H,) m/s, ways (H, 4, 3) m and times (H, 4) s."""
        hits = [one.hit for one in self.hits]
        return (np.array([hit.size for hit in hits]), np.array([hit.max_speed for hit in hits]),
                np.array([hit.vectors for hit in hits]).reshape(-1, 4, 3),
                np.array([hit.times for hit in hits]).reshape(-1, 4))

    @cached_property
    def sides(self) -> np.ndarray:
        """(H,) "left", "right" or ""."""
        return np.array([one.hit.side for one in self.hits], dtype="<U5")

    @property
    def speeds(self) -> np.ndarray:
        """(H,) m/s: the part's greatest speed."""
        return self._arrays[1]

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """Toss, pass or attack, by the greatest speed (§5)."""
        return tuple(KINDS[int(np.searchsorted(_bounds(self.part), speed, "right"))] for speed in self.speeds)

    def match(self, example: HitMotion, weights: MatchWeights = MatchWeights(),
              side: str | None = None) -> tuple[np.ndarray, np.ndarray]:
        """How much each hit motion differs from an example (eq. 2), and their order.

        side: only hit motions of this side (None: all). Returns (order (K,), most alike first, indices into `hits`;
        distance (H,) m). Ways are compared as each body sees them, so it does not matter where either faces."""
        size, speed, vectors, times = self._arrays
        grown = size / max(example.size, 1e-6)
        distance = weights.speed * np.abs(speed - grown * example.max_speed)
        away = vectors - grown[:, None, None] * example.vectors
        distance += weights.vector * np.sqrt(np.einsum("hik,hik->hi", away, away)).sum(axis=1)
        distance += weights.time * np.abs(times - example.times).sum(axis=1)
        order = np.argsort(distance, kind="stable")
        return (order if side is None else order[self.sides[order] == side]), distance

    def of_kind(self, kind: str, side: str | None = None) -> np.ndarray:
        """Indices (K,) into `hits`, what suits a toss, a pass or an attack best first: whose speed lies in the kind's
        range, then whose is nearest to it; within the range those that words name first, then the nearest to its middle
        (of attacks the fastest)."""
        edges = (0.0, *_bounds(self.part), np.inf)
        low, high = edges[KINDS.index(kind)], edges[KINDS.index(kind) + 1]
        outside = np.maximum(low - self.speeds, 0.0) + np.maximum(self.speeds - high, 0.0)
        unnamed = np.array([not one.labelled for one in self.hits], dtype=bool)
        typical = np.abs(self.speeds - 0.5 * (low + high)) if np.isfinite(high) else -self.speeds
        order = np.lexsort((np.arange(len(self)), typical, unnamed, outside))
        return order if side is None else order[self.sides[order] == side]


def kind_of(hit: HitMotion) -> str:
    """Toss, pass or attack, by the greatest speed of the part (§5)."""
    return KINDS[int(np.searchsorted(_bounds(hit.part), hit.max_speed, "right"))]


def _bounds(part: str) -> tuple[float, float]:
    return _BOUNDS.get(part, _BOUNDS["foot"])


def _of_clip(index: int, clip: Clip, part: str, tool: Tool | None) -> list[LibraryHit]:
    if len(clip.recording) < 3:
        return []
    sides = ("left", "right") if part in ("foot", "hand", "tool") else ("",)
    hits = [hit for side in sides for hit in analyse(clip.recording, part, side, tool=tool).motions]
    found = [_labelled(index, clip, hit) for hit in hits]
    found += [LibraryHit(index, hit, True) for hit in _unseen(clip, part, sides, hits, tool)]
    return sorted(found, key=lambda one: one.hit.first)


def _labelled(index: int, clip: Clip, hit: HitMotion) -> LibraryHit:
    """The hit motion with the key that the clip's words give, where they name a touch of this part within it."""
    for row in clip.annotations:
        if row.key is not None and hit.first < row.key < hit.last and _names(row.words, hit.part, hit.side):
            return LibraryHit(index, replace(hit, key=int(round(row.key))), True)
    return LibraryHit(index, hit, False)


def _unseen(clip: Clip, part: str, sides, hits: list[HitMotion], tool: Tool | None) -> list[HitMotion]:
    """Touches that the clip's words name and the analysis has not seen: a trap is slow, a header may do without a jump.
    Where the words name no side, it is the faster one."""
    found = []
    for row in clip.annotations:
        if row.key is None or any(hit.first < row.key < hit.last and _names(row.words, part, hit.side) for hit in hits):
            continue
        named = [side for side in sides if _names(row.words, part, side)]
        made = [hit_at(clip.recording, int(round(row.key)), _around(row, clip), part=part, side=side,
                       tool=tool) for side in named]
        found += [hit for hit in sorted(made, key=lambda hit: -hit.max_speed)[:1] if hit.max_speed > _MOVES]
    return found


def _around(row, clip: Clip) -> tuple[int, int]:
    """First and last frame of a touch: its row, at most a second before and behind its key."""
    reach = clip.motion.fps
    return int(max(row.start, row.key - reach)), int(min(row.end, row.key + reach))


def _names(words, part: str, side: str) -> bool:
    """Whether words name a touch of this part and side."""
    sides = {"left", "right"} & set(words) if part in ("foot", "hand") else set()
    return striking_part(words) == part and (not sides or side in sides)


def _told(clip: Clip, hit: HitMotion) -> bool:
    """Whether the clip's words call this a touch of the part, or say nothing here but elsewhere in the clip; words do
    not know tools and joints."""
    if hit.part not in BODY_PARTS:
        return True
    here = [row.words for row in clip.annotations if row.start <= hit.key <= row.end]
    rows = here or [row.words for row in clip.annotations]
    juggles = any(may_use_several(words, hit.part) for words in rows)
    return juggles or any(_names(words, hit.part, hit.side) for words in rows)


_WHOLE = ("first", "last", "high", "key")
_NUMBERS = ("max_speed", "facing", "size", "fps")
_ARRAYS = ("vectors", "times", "velocity", "fasts")


def _stored(hits: tuple[LibraryHit, ...]) -> dict[str, np.ndarray]:
    arrays = {name: np.array([getattr(one.hit, name) for one in hits]) for name in (*_WHOLE, *_NUMBERS, *_ARRAYS)}
    arrays["clip"], arrays["labelled"] = np.array([one.clip for one in hits]), np.array([one.labelled for one in hits])
    arrays["side"] = np.array([one.hit.side for one in hits], dtype="<U5")
    return arrays


def _restored(part: str, arrays: dict[str, np.ndarray]) -> tuple[LibraryHit, ...]:
    found = []
    for row in range(len(arrays["clip"])):
        read: dict[str, Any] = {name: int(arrays[name][row]) for name in _WHOLE}
        read |= {name: float(arrays[name][row]) for name in _NUMBERS}
        read |= {name: arrays[name][row] for name in ("vectors", "times", "velocity")}
        fasts = tuple(int(frame) for frame in arrays["fasts"][row])
        hit = HitMotion(part=part, side=str(arrays["side"][row]), fasts=fasts, **read)
        found.append(LibraryHit(int(arrays["clip"][row]), hit, bool(arrays["labelled"][row])))
    return tuple(found)
