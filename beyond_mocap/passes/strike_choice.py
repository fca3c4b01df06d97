"""Which hit motions of a library may serve a strike: by what its words say and the part's speed (Ball handling §5).

Words go before measuring: a clip that is called a header serves heads and no hands, though its arms swing as in a
strike; nor does one of somebody who gets up or celebrates.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..annotation.ball_contact import striking_part
from ..annotation.labels import list_labels
from ..ball.contact import Tool, striking_surface
from ..ball.physics import FASTEST
from ..library.library import Library
from .hit_library import HitLibrary, LibraryHit
from .orders import HitOrder
from .pass_scene import RECEIVE

TOOL_WORDS = frozenset(list_labels(part="tool"))
RECEIVE_WORDS = frozenset(list_labels(ball="takes"))
OTHER_ACTS = frozenset(list_labels(ball="never"))
_SAID, _SILENT, _OTHER = range(3)
_HAND_VOLLEY = {"hand", "volley"}  # a volleyball player's, no footballer's
_SIDED = ("foot", "hand", "tool")


@dataclass(frozen=True, eq=False)
class Choice:
    """All strikes of a library with one part, and the words of each at its strike."""

    part: str
    measured: HitLibrary
    words: tuple[frozenset[str], ...]

    @classmethod
    def of(cls, library: Library, part: str, tool: Tool | None = None) -> Choice:
        """InputError for a part that the skeleton lacks."""
        striking_surface(library.skeleton, part, "right" if part in _SIDED else "", tool)
        measured = HitLibrary.of(library, part, tool)
        return cls(part, measured, tuple(_words_at(library, one.clip, one.hit.key) for one in measured.hits))

    @property
    def hits(self) -> tuple[LibraryHit, ...]:
        """The strikes."""
        return self.measured.hits

    def of_kind(self, kind: str, side: str = "") -> tuple[LibraryHit, ...]:
        """The strikes that serve a toss, a pass, an attack or a receive, the best first; side: "left", "right", or
        either."""
        found = self._called([i for i, one in enumerate(self.hits) if not side or one.hit.side in ("", side)])
        stops = [i for i in found if self.words[i] & RECEIVE_WORDS]
        if kind == RECEIVE:
            found = stops or found
        else:
            found = [i for i in found if i not in stops] or found
        named = [i for i in found if kind in self.words[i]]
        if named or kind == RECEIVE:
            return tuple(self.hits[i] for i in (named or sorted(found, key=lambda i: self.hits[i].hit.max_speed)))
        return self._by_speed(kind, found)

    def _called(self, among: list[int]) -> list[int]:
        """Those that words call strikes of the part; where there are none, those that words say nothing of."""
        ranks = [_rank(self.part, self.words[i]) for i in among]
        best = min(ranks, default=_OTHER)
        return [i for i, rank in zip(among, ranks) if rank == best < _OTHER]

    def _by_speed(self, kind: str, among: list[int]) -> tuple[LibraryHit, ...]:
        order = [int(i) for i in self.measured.of_kind(kind) if int(i) in set(among)]
        same = [i for i in order if self.measured.kinds[i] == kind]
        return tuple(self.hits[i] for i in (same or order))


def unsaid(library: Library, order: HitOrder) -> bool:
    """Whether no words call an ordered motion a strike of its part, so that it is one by its speed alone."""
    return _rank(order.part, _words_at(library, order.clip, order.strike_frame)) != _SAID


def _rank(part: str, words: frozenset[str]) -> int:
    said = _said_part(words)
    if words & OTHER_ACTS or (said not in (None, part) and part in FASTEST):
        return _OTHER
    return _SAID if said == part else _SILENT


def _said_part(words: frozenset[str]) -> str | None:
    """Which part words say that strikes."""
    if words & TOOL_WORDS:
        return "tool"
    return "hand" if _HAND_VOLLEY <= words else striking_part(words)


def _words_at(library: Library, clip: int, frame: float) -> frozenset[str]:
    rows = [row for row in library.clips[clip].annotations if row.start <= frame <= row.end]
    return frozenset(word for row in rows for word in row.words)
