"""Every moment in which some hit motion can meet the ball: the frames of all ball stretches (Table 1, steps
2 and 5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..ball.contact import StruckFrom, Tool, ball_centre, in_world, striking_surface, struck_from
from ..base.vectors import unit_vectors
from ..library.library import Library
from ..motion import quaternion
from .hit_library import LibraryHit

MOST_FRAMES = 7
"""Moments that are looked at in one ball stretch at most, spread evenly."""

_BACK_ON_LIMB = 0.2  # of a normal's length that may point up the limb, where the shin or the forearm is


@dataclass(frozen=True, eq=False)
class StrikeMoments:
    """N moments, in the body's own frame of each (`contact`), for a body `size` times as large as the library's.

    hits (H,): whose moments they are; which (N,): index into them; frame (N,): in the clip's own rate. struck: the part
    there. lead, trail (N,) s: from the hit motion's first frame, and to its last. travel (N,) m: how far the body goes
    on the ground in the hit motion.
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
        return replace(
            self, which=self.which[which], frame=self.frame[which], lead=self.lead[which], trail=self.trail[which],
            travel=self.travel[which],
            struck=StruckFrom(struck.start[which], struck.end[which], struck.radius, struck.velocity[which]),
        )

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


def strike_moments(
    library: Library, hits: Sequence[LibraryHit], tool: Tool | None = None, size: float = 1.0
) -> StrikeMoments:
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
        return StrikeMoments((), nothing.astype(int), nothing, empty, nothing, nothing, nothing)
    joined = (np.concatenate([getattr(one, name) for one in struck]) * size for name in ("start", "end", "velocity"))
    start, end, velocity = joined
    return StrikeMoments(
        tuple(hits), np.concatenate(which), np.concatenate(frames),
        StruckFrom(start, end, struck[0].radius * size, velocity), np.concatenate(lead), np.concatenate(trail),
        np.concatenate(travel),
    )


def launched_from(moments: StrikeMoments, place: np.ndarray, facing: np.ndarray, radius: float):
    """Places (N, 3) m and velocities (N, 3) m/s with which a ball naturally leaves the parts of a body at `place` (2,)
    that faces `facing` (N,) rad: off the part's surface where it goes, as fast as the part."""
    velocity = moments.struck.velocity
    own = moments.ball(unit_vectors(velocity), radius)
    return in_world(own, place, facing), quaternion.rotate(quaternion.about_up(facing), velocity)

