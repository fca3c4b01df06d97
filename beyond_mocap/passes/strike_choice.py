"""Which hit motions of a library may serve a strike, and every moment in which they can meet the ball.

By what the library's words say and the part's speed (Ball handling §5). Words go before measuring: a clip that is
called a header serves heads and no hands, though its arms swing as in a strike; nor does one of a player who gets up or
celebrates. The moments are the frames of all ball stretches (Table 1, steps 2 and 5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..annotation.ball_contact import striking_part
from ..annotation.labels import list_labels
from ..ball.contact import StruckFrom, Tool, ball_centre, in_world, striking_surface, struck_from
from ..ball.physics import FASTEST
from ..base.vectors import unit_vectors
from ..library.library import Library
from ..motion import quaternion
from .hit_library import HitLibrary, LibraryHit
from .pass_scene import RECEIVE
from .way import HitOrder

TOOL_WORDS = frozenset(list_labels(part="tool"))
RECEIVE_WORDS = frozenset(list_labels(ball="takes"))
OTHER_ACTS = frozenset(list_labels(ball="never"))
_SAID, _SILENT, _OTHER = range(3)
_HAND_VOLLEY = {"hand", "volley"}  # a volleyball player's, no footballer's
_SIDED = ("foot", "hand", "tool")

MOST_FRAMES = 7
"""Moments that are looked at in one ball stretch at most, spread evenly."""
_BACK_ON_LIMB = 0.2  # of a normal's length that may point up the limb, where the shin or the forearm is


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


@dataclass(frozen=True, eq=False, kw_only=True)
class StrikeMoments:
    """N moments, in the body's own frame of each (`contact`), for a body `size` times as large as the library's.

    hits (H,): whose moments they are; which (N,): index into them; frame (N,): in the clip's own rate. struck: the part
    there. lead, trail (N,) s: from the hit motion's first frame, and to its last. travel (N,) m: how far the body goes
    on the ground in the hit motion."""

    hits: tuple[LibraryHit, ...]
    which: np.ndarray
    frame: np.ndarray
    struck: StruckFrom
    lead: np.ndarray
    trail: np.ndarray
    travel: np.ndarray

    def __len__(self) -> int:
        return len(self.which)

    def only(self, which: Sequence[int] | np.ndarray) -> StrikeMoments:
        """Those of a mask or of indices (M,)."""
        struck = self.struck
        return replace(self, which=self.which[which], frame=self.frame[which], lead=self.lead[which],
                       trail=self.trail[which], travel=self.travel[which],
                       struck=StruckFrom(struck.start[which], struck.end[which], struck.radius, struck.velocity[which]))

    def ball(self, normal: np.ndarray, radius: float) -> np.ndarray:
        """(N, 3) m, own frame: the centre of a ball that lies on the part toward `normal` (N, 3), own frame."""
        return ball_centre(self.struck, self.off_the_limb(normal), radius)

    def off_the_limb(self, normal: np.ndarray) -> np.ndarray:
        """Normals (N, 3), unit, that do not point up the shin or the tool's handle, where no ball has room."""
        along = self.struck.end - self.struck.start
        long = np.linalg.norm(along, axis=-1, keepdims=True)
        along = along / np.maximum(long, 1e-9)
        back = np.sum(normal * along, axis=-1, keepdims=True)
        spare = np.where(long > 1e-6, np.minimum(back + _BACK_ON_LIMB, 0.0), 0.0)
        out = normal - spare * along
        return unit_vectors(out)


def strike_moments(library: Library, hits: Sequence[LibraryHit], tool: Tool | None = None,
                   size: float = 1.0) -> StrikeMoments:
    """The moments of these hit motions, in their order."""
    which, frames, struck, lead, trail, travel = [], [], [], [], [], []
    for number, one in enumerate(hits):
        motion, hit = library.clips[one.clip].recording, one.hit
        surface = striking_surface(motion.skeleton, hit.part, hit.side, tool)
        first, last = hit.ball_stretch
        own = np.unique(np.round(np.linspace(first, last, MOST_FRAMES)))
        gone = motion.root_positions[[hit.first, hit.last], :2]
        which.append(np.full(len(own), number))
        frames.append(own)
        struck.append(struck_from(motion, own, surface))
        lead.append((own - hit.first) / hit.fps)
        trail.append((hit.last - own) / hit.fps)
        travel.append(np.full(len(own), size * np.linalg.norm(gone[1] - gone[0])))
    if not hits:
        nothing = np.zeros(0)
        empty = StruckFrom(np.zeros((0, 3)), np.zeros((0, 3)), 0.0, np.zeros((0, 3)))
        return StrikeMoments(hits=(), which=nothing.astype(int), frame=nothing, struck=empty, lead=nothing,
                             trail=nothing, travel=nothing)
    joined = (np.concatenate([getattr(one, name) for one in struck]) * size for name in ("start", "end", "velocity"))
    start, end, velocity = joined
    return StrikeMoments(hits=tuple(hits), which=np.concatenate(which), frame=np.concatenate(frames),
                         struck=StruckFrom(start, end, struck[0].radius * size, velocity), lead=np.concatenate(lead),
                         trail=np.concatenate(trail), travel=np.concatenate(travel))


def launched_from(moments: StrikeMoments, place: np.ndarray, facing: np.ndarray, radius: float):
    """Places (N, 3) m and velocities (N, 3) m/s with which a ball naturally leaves the parts of a body at `place` (2,)
    that faces `facing` (N,) rad: off the part's surface where it goes, as fast as the part."""
    velocity = moments.struck.velocity
    own = moments.ball(unit_vectors(velocity), radius)
    return in_world(own, place, facing), quaternion.rotate(quaternion.about_up(facing), velocity)
