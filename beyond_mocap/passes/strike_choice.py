"""The hit motions of a library that can serve a strike, and every moment in which they can meet the ball.

They are chosen by the library's labels and by the part's speed (Ball handling, section 5). Labels count more than
measurement: a clip labelled as a header serves heads and no hands, though its arms swing as in a strike; a clip of a
player who gets up or celebrates serves neither. The moments are the frames of all ball stretches (Table 1, steps 2
and 5).
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
_SAID, _SILENT, _OTHER = range(3)  # labels name this part, no part, or another part or act
_HAND_VOLLEY = {"hand", "volley"}  # a volleyball player's volley, not a footballer's
_SIDED = ("foot", "hand", "tool")

MOST_FRAMES = 7
"""Most moments that are tried in one ball stretch, spread evenly."""
_BACK_ON_LIMB = 0.2  # of a unit normal: most that may point back along the limb, to the shin or the forearm


@dataclass(frozen=True, eq=False)
class Choice:
    """All strikes of a library with one part.

    Attributes:
        part: part that strikes.
        measured: its hit motions.
        labels: labels of each hit motion at its strike.
    """

    part: str
    measured: HitLibrary
    words: tuple[frozenset[str], ...]

    @classmethod
    def of(cls, library: Library, part: str, tool: Tool | None = None) -> Choice:
        """Build the strikes of a library with a part.

        Args:
            library: the library.
            part: "foot", "head", "chest", "hand", "tool", or a joint's name.
            tool: what is in the hand.
        Returns:
            The strikes.
        Raises:
            InputError: if the skeleton lacks the part.
        """
        striking_surface(library.skeleton, part, "right" if part in _SIDED else "", tool)
        measured = HitLibrary.of(library, part, tool)
        return cls(part, measured, tuple(_words_at(library, one.clip, one.hit.key) for one in measured.hits))

    @property
    def hits(self) -> tuple[LibraryHit, ...]:
        """The hit motions."""
        return self.measured.hits

    def of_kind(self, kind: str, side: str = "") -> tuple[LibraryHit, ...]:
        """Choose the strikes that serve a kind of pass.

        Args:
            kind: "toss", "pass", "attack" or "receive".
            side: "left", "right", or "" for either.
        Returns:
            The hit motions, best first.
        """
        # labels first: other parts' strikes and other acts are out
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
        """Choose those that labels call strikes of the part; if there are none, those without such labels."""
        ranks = [_rank(self.part, self.words[i]) for i in among]
        best = min(ranks, default=_OTHER)
        return [i for i, rank in zip(among, ranks) if rank == best < _OTHER]

    def _by_speed(self, kind: str, among: list[int]) -> tuple[LibraryHit, ...]:
        """Sort strikes by how well their speed suits a kind; strikes of other kinds only if there are no others."""
        order = [int(i) for i in self.measured.of_kind(kind) if int(i) in set(among)]
        same = [i for i in order if self.measured.kinds[i] == kind]
        return tuple(self.hits[i] for i in (same or order))


def unsaid(library: Library, order: HitOrder) -> bool:
    """Whether no labels call an ordered motion a strike of its part, so that it counts as one by its speed alone."""
    return _rank(order.part, _words_at(library, order.clip, order.strike_frame)) != _SAID


def _rank(part: str, words: frozenset[str]) -> int:
    """Rank labels for a part: _NAMED, _UNNAMED or _OTHER."""
    said = _said_part(words)
    if words & OTHER_ACTS or (said not in (None, part) and part in FASTEST):
        return _OTHER
    return _SAID if said == part else _SILENT


def _said_part(words: frozenset[str]) -> str | None:
    """Find the part that strikes by the labels; None if they name none."""
    if words & TOOL_WORDS:
        return "tool"
    return "hand" if _HAND_VOLLEY <= words else striking_part(words)


def _words_at(library: Library, clip: int, frame: float) -> frozenset[str]:
    """Collect the labels of a clip at a frame."""
    rows = [row for row in library.clips[clip].annotations if row.start <= frame <= row.end]
    return frozenset(word for row in rows for word in row.words)


@dataclass(frozen=True, eq=False, kw_only=True)
class StrikeMoments:
    """N moments of H hit motions, each in the body's own frame, for a body of any size.

    Attributes:
        hits: (H,) hit motions.
        which: (N,) index into `hits`.
        frame: (N,) frame in the clip's own rate.
        part_states: the part at these moments.
        lead: (N,) s from the hit motion's first frame.
        trail: (N,) s to the hit motion's last frame.
        travel: (N,) m, how far the body travels on the ground in the hit motion.
    """

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
        """Compute the centre of a ball that touches the part.

        Args:
            normal: (N, 3) unit vectors from part to ball, own frame.
            radius: of the ball, m.
        Returns:
            (N, 3) m, own frame.
        """
        return ball_centre(self.struck, self.off_the_limb(normal), radius)

    def off_the_limb(self, normal: np.ndarray) -> np.ndarray:
        """Limit normals (N, 3) so that they do not point up the shin or the tool's handle, where there is no room for a
        ball.
        """
        along = self.struck.end - self.struck.start
        long = np.linalg.norm(along, axis=-1, keepdims=True)
        along = along / np.maximum(long, 1e-9)
        # cosine with the limb's direction: negative where the normal points back along the limb
        back = np.sum(normal * along, axis=-1, keepdims=True)
        spare = np.where(long > 1e-6, np.minimum(back + _BACK_ON_LIMB, 0.0), 0.0)
        out = normal - spare * along
        return unit_vectors(out)


def strike_moments(library: Library, hits: Sequence[LibraryHit], tool: Tool | None = None,
                   size: float = 1.0) -> StrikeMoments:
    """Collect the moments of hit motions, in their order.

    Args:
        library: the library.
        hits: its hit motions, all of one part.
        tool: what is in the hand.
        size: size of the body over that of the library's skeleton.
    Returns:
        The moments, MOST_FRAMES at most for each hit motion.
    """
    which, frames, struck, lead, trail, travel = [], [], [], [], [], []
    for number, one in enumerate(hits):
        motion, hit = library.clips[one.clip].recording, one.hit
        surface = striking_surface(motion.skeleton, hit.part, hit.side, tool)
        first, last = hit.ball_stretch
        # whole frames spread over the ball stretch
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
    """Compute how a ball naturally leaves a part: off its surface where it moves to, as fast as the part.

    Args:
        moments: N moments.
        place: (2,) m, the body on the ground, world frame.
        facing: (N,) rad, headings of the body.
        radius: of the ball, m.
    Returns:
        places: (N, 3) m, world frame.
        velocities: (N, 3) m/s, world frame.
    """
    velocity = moments.struck.velocity
    own = moments.ball(unit_vectors(velocity), radius)
    return in_world(own, place, facing), quaternion.rotate(quaternion.about_up(facing), velocity)
