"""Which hit motions of a library may serve a strike: by what its words say, and by the part's speed (Ball handling §5).

Words go before measuring: a clip that is called a header serves heads and no hands, though its arms swing as in a strike.
What words call a touch serves even where the hit analysis sees none, as a trap with the foot low.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..library.library import Library
from ..motion.humanoid import leg_length
from ..motion.striking import striking_part
from .contact import Tool, struck_from, striking_surface
from .hit_library import HitLibrary, LibraryHit
from .hits import HitMotion

TOOL_WORDS = frozenset({"stroke", "racquet", "racket", "swing", "bat", "serve"})
RECEIVE_WORDS = frozenset({"receive", "trap", "catch", "catchb"})
_SAID, _SILENT, _OTHER = range(3)
_SIDED = ("foot", "hand", "tool")


@dataclass(frozen=True, eq=False)
class Choice:
    """All strikes of a library with one part. hits: as measured, and behind them those that only words know; words of
    each at its strike."""

    library: Library
    part: str
    measured: HitLibrary
    hits: tuple[LibraryHit, ...]
    words: tuple[frozenset[str], ...]

    @classmethod
    def of(cls, library: Library, part: str, tool: Tool | None = None) -> Choice:
        """InputError for a part that the skeleton lacks."""
        striking_surface(library.skeleton, part, "right" if part in _SIDED else "", tool)
        measured = HitLibrary.of(library, part, tool)
        hits = (*measured.hits, *_only_named(library, part, measured, tool))
        return cls(library, part, measured, hits, tuple(_words_at(library, one) for one in hits))

    def of_kind(self, kind: str, side: str = "") -> tuple[LibraryHit, ...]:
        """The strikes that serve a toss, a pass, an attack or a receive, the best first; side: "left", "right", or
        either."""
        wanted = {"receive"} if kind == "receive" else {kind}
        found = self._called([i for i, one in enumerate(self.hits) if not side or one.hit.side in ("", side)])
        stops = [i for i in found if self.words[i] & RECEIVE_WORDS]
        if kind == "receive":
            found = stops or found
        else:
            found = [i for i in found if i not in stops] or found
        named = [i for i in found if self.words[i] & wanted]
        if named or kind == "receive":
            return tuple(self.hits[i] for i in (named or sorted(found, key=lambda i: self.hits[i].hit.max_speed)))
        return self._by_speed(kind, found)

    def _called(self, among: list[int]) -> list[int]:
        """Those that words call strikes of the part; where there are none, those that words say nothing of."""
        ranks = [_rank(self.part, self.words[i]) for i in among]
        return [i for i, rank in zip(among, ranks) if rank == min(ranks)]

    def _by_speed(self, kind: str, among: list[int]) -> tuple[LibraryHit, ...]:
        count = len(self.measured)
        order = [int(i) for i in self.measured.of_kind(kind) if int(i) in set(among)]
        same = [i for i in order if self.measured.kinds[i] == kind]
        return tuple(self.hits[i] for i in (same or [*order, *(i for i in among if i >= count)]))


def _rank(part: str, words: frozenset[str]) -> int:
    said = _said_part(words)
    return _SILENT if said is None else _SAID if said == part else _OTHER


def _said_part(words: frozenset[str]) -> str | None:
    """Which part words say that strikes."""
    if words & TOOL_WORDS:
        return "tool"
    return "hand" if "hand" in words and "volley" in words else striking_part(words)


def _words_at(library: Library, one: LibraryHit) -> frozenset[str]:
    clip = library.clips[one.clip]
    rows = [row for row in clip.annotations if row.start <= one.hit.key <= row.end]
    return frozenset(word for row in rows for word in row.words)


def _only_named(library: Library, part: str, measured: HitLibrary, tool: Tool | None) -> list[LibraryHit]:
    """Key moments that words call strikes of the part and the hit analysis has not found."""
    known: dict[int, list[HitMotion]] = {}
    for one in measured.hits:
        known.setdefault(one.clip, []).append(one.hit)
    out = []
    for key in library.keys:
        clip = library.clips[key.clip]
        if clip.made or _said_part(key.words) != part or any(h.first < key.frame < h.last for h in known.get(key.clip, ())):
            continue
        side = next((side for side in ("right", "left") if side in key.words), "right") if part in _SIDED else ""
        hit = _named_hit(clip.recording, part, side, key, tool)
        if hit is not None:
            out.append(LibraryHit(key.clip, hit, True))
    return out


def _named_hit(motion, part: str, side: str, key, tool: Tool | None) -> HitMotion | None:
    """The hit motion of a row of words, which lasts as long as the row."""
    first, at, last = int(np.ceil(key.start)), int(round(key.frame)), int(min(np.floor(key.end), len(motion) - 1))
    if not first < at < last:
        return None
    frames = np.array([first, at, at, at, last])
    surface = striking_surface(motion.skeleton, part, side, tool)
    struck = struck_from(motion, frames, surface)
    middle = 0.5 * (struck.start + struck.end)
    return HitMotion(
        part=part, side=side, first=first, last=last, high=at, fasts=(at, at), key=at,
        max_speed=float(np.linalg.norm(struck.velocity[1])), vectors=np.diff(middle, axis=0),
        times=np.diff(frames) / motion.fps, velocity=struck.velocity[1], facing=0.0, size=leg_length(motion.skeleton),
        fps=motion.fps,
    )  # fmt: skip

