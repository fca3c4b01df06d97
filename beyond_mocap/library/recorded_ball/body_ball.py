"""The ball of a recording: read with the clip, and carried along with what a build does to the body.

A ball lies in a table beside the recording (`kick.ball.csv` beside `kick.bvh`, as `--ball` writes it), in the table
that a conversion of FBX, glTF or USD leaves, or is a joint of the BVH file.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.time_series import interpolate_columns
from ...files.bvh.bvh import BvhClip
from ...files.bvh.bvh_write import BvhForm
from ...files.tables import read_ball
from ...motion.humanoid import measure_leg_length
from ...motion.motion import Motion
from ...motion.skeleton import Skeleton
from ...motion.track import BALL_RADIUS
from .ball_table import find_ball_table

_FARTHEST = 150.0  # m from the body, as far as a pitch is long; a ball beyond is in a wrong unit or place
_GAP_SECONDS = 0.25  # within which a ball that is not known is interpolated
_UP = np.array([0.0, 0.0, BALL_RADIUS])


@dataclass(frozen=True, eq=False)
class BodyBall:
    """A ball as seen from the hips of the body as recorded.

    Attributes:
        offset: (T, 3) m from the hips to the ball, less its radius upward; NaN where it is not known.
        skeleton: of the body.
    """

    offset: np.ndarray
    skeleton: Skeleton

    def place(self, motion: Motion) -> np.ndarray:
        """Place the ball beside another form of the same motion: repaired, or on a body of other size.

        Args:
            motion: T frames.
        Returns:
            (T, 3) m, the ball's centre in the motion's world, never below the floor at height 0.
        """
        size = measure_leg_length(motion.skeleton) / measure_leg_length(self.skeleton)
        ball = motion.root_positions + size * self.offset + _UP
        return np.where(ball < [-np.inf, -np.inf, BALL_RADIUS], BALL_RADIUS, ball) if size != 1.0 else ball


def read_recorded_ball(path: Path, file: Path, source: BvhClip) -> tuple[BodyBall | None, tuple[str, ...]]:
    """Read the ball of a recording.

    Args:
        path: the recording.
        file: what was read in its place.
        source: what was read.
    Returns:
        The ball, None without one, and notes for the user.
    Raises:
        InputError: for a table that cannot be read.
    """
    table, motion = find_ball_table(path, file), source.motion
    name = path.name if table is None else table.name
    ball = source.ball if table is None else _sample_table(table, motion)
    if table is not None and table.parent != path.parent:  # a conversion's, whose ball is in the unit of its body
        ball = ball * (source.form.unit / BvhForm.unit)
    if ball is None:
        return None, ()
    known = np.isfinite(ball).all(axis=1)
    if not known.any():
        return None, (f"{name}: the ball is not known at any time of the recording's {motion.duration:.1f} s; ignored",)
    gap = np.where(known, np.linalg.norm(ball - motion.root_positions, axis=1), np.inf)
    if gap.min() > _FARTHEST:
        return None, (f"{name}: the ball is {gap.min():.0f} m from the body at its nearest; ignored; check its unit",)
    known &= gap <= _FARTHEST
    missing = 1.0 - known.mean()
    notes = (f"{name}: the ball is not known for {missing:.0%} of the recording",) if missing > 0.02 else ()
    offset = np.where(known[:, None], ball - motion.root_positions - _UP, np.nan)
    return BodyBall(offset, motion.skeleton), notes


def _sample_table(table: Path, motion: Motion) -> np.ndarray:
    """Sample a table's ball (T, 3) m at the motion's frames; NaN outside, and in gaps that are long."""
    ball = read_ball(table)
    known = np.isfinite(ball.positions).all(axis=1)
    order = np.argsort(ball.times[known], kind="stable")
    times, positions = ball.times[known][order], ball.positions[known][order]
    if not len(times):
        return np.full((len(motion), 3), np.nan)
    at = np.arange(len(motion)) / motion.fps
    half = 0.5 / motion.fps  # a table that ends with the motion may end a rounding earlier
    after = np.clip(np.searchsorted(times, at), 1, max(len(times) - 1, 1))
    spacing = np.append(times, times[-1])[after] - times[after - 1]
    is_known = (at >= times[0] - half) & (at <= times[-1] + half) & (spacing <= _GAP_SECONDS)
    return np.where(is_known[:, None], interpolate_columns(at, times, positions), np.nan)
