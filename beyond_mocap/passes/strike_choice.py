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

from ..annotation.ball_contact import find_striking_part
from ..annotation.labels import list_labels
from ..annotation.striking import SIDED_PARTS
from ..ball.contact import (
    StrikeSurface,
    Tool,
    compute_ball_centre,
    convert_to_world,
    find_striking_surface,
    sample_strike_surface,
)
from ..ball.physics import HUMAN_BALL_SPEEDS
from ..base.vectors import unit_vectors
from ..library.library import Library
from ..motion import quaternion
from .hit_library import HitLibrary, LibraryHit
from .pass_scene import RECEIVE
from .player_path import HitOrder

TOOL_LABELS = frozenset(list_labels(part="tool"))
RECEIVE_LABELS = frozenset(list_labels(ball="takes"))
OTHER_ACTS = frozenset(list_labels(ball="never"))
_NAMED, _UNNAMED, _OTHER = range(3)  # labels name this part, no part, or another part or act
_HAND_VOLLEY = {"hand", "volley"}  # a volleyball player's volley, not a footballer's

MOST_FRAMES = 7
"""Most moments that are tried in one ball stretch, spread evenly."""
_LIMB_SHARE = 0.2  # of a unit normal: most that may point back along the limb, to the shin or the forearm


@dataclass(frozen=True, eq=False)
class PartStrikes:
    """All strikes of a library with one part.

    Attributes:
        part: part that strikes.
        measured: its hit motions.
        labels: labels of each hit motion at its strike.
    """

    part: str
    measured: HitLibrary
    labels: tuple[frozenset[str], ...]

    @classmethod
    def from_library(cls, library: Library, part: str, tool: Tool | None = None) -> PartStrikes:
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
        find_striking_surface(library.skeleton, part, "right" if part in SIDED_PARTS else "", tool)
        measured = HitLibrary.from_library(library, part, tool)
        return cls(part, measured, tuple(_collect_labels(library, one.clip, one.hit.key) for one in measured.hits))

    @property
    def hits(self) -> tuple[LibraryHit, ...]:
        """The hit motions."""
        return self.measured.hits

    def select_by_kind(self, kind: str, side: str = "") -> tuple[LibraryHit, ...]:
        """Choose the strikes that serve a kind of pass.

        Args:
            kind: "toss", "pass", "attack" or "receive".
            side: "left", "right", or "" for either.
        Returns:
            The hit motions, best first.
        """
        # labels first: other parts' strikes and other acts are out
        suitable = self._select_labelled([i for i, one in enumerate(self.hits) if not side
                                          or one.hit.side in ("", side)])
        stops = [i for i in suitable if self.labels[i] & RECEIVE_LABELS]
        if kind == RECEIVE:
            suitable = stops or suitable
        else:
            suitable = [i for i in suitable if i not in stops] or suitable
        named = [i for i in suitable if kind in self.labels[i]]
        if named or kind == RECEIVE:
            return tuple(self.hits[i] for i in (named or sorted(suitable, key=lambda i: self.hits[i].hit.max_speed)))
        return self._sort_by_speed(kind, suitable)

    def _select_labelled(self, among: list[int]) -> list[int]:
        """Choose those that labels call strikes of the part; if there are none, those without such labels."""
        ranks = [_rank_labels(self.part, self.labels[i]) for i in among]
        best = min(ranks, default=_OTHER)
        return [i for i, rank in zip(among, ranks) if rank == best < _OTHER]

    def _sort_by_speed(self, kind: str, among: list[int]) -> tuple[LibraryHit, ...]:
        """Sort strikes by how well their speed suits a kind; strikes of other kinds only if there are no others."""
        order = [int(i) for i in self.measured.sort_by_kind(kind) if int(i) in set(among)]
        same = [i for i in order if self.measured.kinds[i] == kind]
        return tuple(self.hits[i] for i in (same or order))


def is_unlabelled_strike(library: Library, order: HitOrder) -> bool:
    """Whether no labels call an ordered motion a strike of its part, so that it counts as one by its speed alone."""
    return _rank_labels(order.part, _collect_labels(library, order.clip, order.strike_frame)) != _NAMED


def _rank_labels(part: str, labels: frozenset[str]) -> int:
    """Rank labels for a part: _NAMED, _UNNAMED or _OTHER."""
    named_part = _find_labelled_part(labels)
    if labels & OTHER_ACTS or (named_part not in (None, part) and part in HUMAN_BALL_SPEEDS):
        return _OTHER
    return _NAMED if named_part == part else _UNNAMED


def _find_labelled_part(labels: frozenset[str]) -> str | None:
    """Find the part that strikes by the labels; None if they name none."""
    if labels & TOOL_LABELS:
        return "tool"
    return "hand" if _HAND_VOLLEY <= labels else find_striking_part(labels)


def _collect_labels(library: Library, clip: int, frame: float) -> frozenset[str]:
    """Collect the labels of a clip at a frame."""
    rows = [row for row in library.clips[clip].annotations if row.start <= frame <= row.end]
    return frozenset(label for row in rows for label in row.words)


@dataclass(frozen=True, eq=False, kw_only=True)
class StrikeMoments:
    """N moments of H hit motions, each in the body's own frame, for a body of any size.

    Attributes:
        hits: (H,) hit motions.
        recordings: (H,) path of the recording of each; a mirror image has the path of its original.
        which: (N,) index into `hits`.
        frame: (N,) frame in the clip's own rate.
        part_states: the part at these moments.
        lead: (N,) s from the hit motion's first frame.
        trail: (N,) s to the hit motion's last frame.
        travel: (N,) m, how far the body travels on the ground in the hit motion.
    """

    hits: tuple[LibraryHit, ...]
    recordings: tuple[str, ...]
    which: np.ndarray
    frame: np.ndarray
    part_states: StrikeSurface
    lead: np.ndarray
    trail: np.ndarray
    travel: np.ndarray

    def __len__(self) -> int:
        return len(self.which)

    def select_moments(self, which: Sequence[int] | np.ndarray) -> StrikeMoments:
        """Those of a mask or of indices (M,)."""
        part_states = self.part_states
        return replace(self, which=self.which[which], frame=self.frame[which], lead=self.lead[which],
                       trail=self.trail[which], travel=self.travel[which],
                       part_states=StrikeSurface(part_states.start[which], part_states.end[which], part_states.radius,
                                                 part_states.velocity[which]))

    def place_ball(self, normal: np.ndarray, radius: float) -> np.ndarray:
        """Compute the centre of a ball that touches the part.

        Args:
            normal: (N, 3) unit vectors from part to ball, own frame.
            radius: of the ball, m.
        Returns:
            (N, 3) m, own frame.
        """
        return compute_ball_centre(self.part_states, self.limit_normals(normal), radius)

    def limit_normals(self, normal: np.ndarray) -> np.ndarray:
        """Limit normals (N, 3) so that they do not point up the shin or the tool's handle, where there is no room for a
        ball.
        """
        along = self.part_states.end - self.part_states.start
        length = np.linalg.norm(along, axis=-1, keepdims=True)
        along = along / np.maximum(length, 1e-9)
        # cosine with the limb's direction: negative where the normal points back along the limb
        along_share = np.sum(normal * along, axis=-1, keepdims=True)
        excess = np.where(length > 1e-6, np.minimum(along_share + _LIMB_SHARE, 0.0), 0.0)
        out = normal - excess * along
        return unit_vectors(out)


def collect_strike_moments(library: Library, hits: Sequence[LibraryHit], tool: Tool | None = None,
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
    which, frames, part_states, lead, trail, travel = [], [], [], [], [], []
    for number, one in enumerate(hits):
        motion, hit = library.clips[one.clip].recording, one.hit
        surface = find_striking_surface(motion.skeleton, hit.part, hit.side, tool)
        first, last = hit.ball_stretch
        # whole frames spread over the ball stretch
        frames_tried = np.unique(np.round(np.linspace(first, last, MOST_FRAMES)))
        ends = motion.root_positions[[hit.first, hit.last], :2]
        which.append(np.full(len(frames_tried), number))
        frames.append(frames_tried)
        part_states.append(sample_strike_surface(motion, frames_tried, surface))
        lead.append((frames_tried - hit.first) / hit.fps)
        trail.append((hit.last - frames_tried) / hit.fps)
        travel.append(np.full(len(frames_tried), size * np.linalg.norm(ends[1] - ends[0])))
    if not hits:
        nothing = np.zeros(0)
        empty = StrikeSurface(np.zeros((0, 3)), np.zeros((0, 3)), 0.0, np.zeros((0, 3)))
        return StrikeMoments(hits=(), recordings=(), which=nothing.astype(int), frame=nothing, part_states=empty,
                             lead=nothing, trail=nothing, travel=nothing)
    scaled = (np.concatenate([getattr(one, name) for one in part_states]) * size
              for name in ("start", "end", "velocity"))
    start, end, velocity = scaled
    recordings = tuple(library.clips[one.clip].path for one in hits)
    return StrikeMoments(hits=tuple(hits), recordings=recordings, which=np.concatenate(which),
                         frame=np.concatenate(frames),
                         part_states=StrikeSurface(start, end, part_states[0].radius * size, velocity),
                         lead=np.concatenate(lead), trail=np.concatenate(trail), travel=np.concatenate(travel))


def compute_natural_launch(moments: StrikeMoments, place: np.ndarray, facing: np.ndarray, radius: float):
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
    velocity = moments.part_states.velocity
    own = moments.place_ball(unit_vectors(velocity), radius)
    return convert_to_world(own, place, facing), quaternion.rotate(quaternion.from_up_angle(facing), velocity)
