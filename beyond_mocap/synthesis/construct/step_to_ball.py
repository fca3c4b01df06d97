"""Step towards a ball that a part just misses: the pelvis goes there within what its track leaves open, feet stay.

A slow player's track is noisier than what it says, so there the root may be some centimetres off it; a fast one's is
followed to a centimetre or two, averaged over a stride, and a pelvis that swings to a kick and back stays within that.
"""

from __future__ import annotations

import numpy as np

from ...motion.humanoid import identify_joints
from .move_body_part import Body, hold_foot

SLOW_STEP, FAST_STEP = 0.12, 0.04
"""Metres that the pelvis may step off its track at a touch: of a player slower than SLOW_SPEED and faster than
FAST_SPEED. A swing of 0.04 m that lasts 0.5 s is 0.013 m in the mean over 1.5 s that a track is measured with."""

SLOW_SPEED, FAST_SPEED = 1.0, 2.0  # m/s
_SPEED_SECONDS = 0.25  # s before and after a touch over which the body's speed is measured
_SHARES = (1.0, 0.75, 0.5, 0.25)  # of a step, the first of which the standing leg follows
_HELD = 0.005  # m that a foot which stands may yield


def measure_level_speed(root: np.ndarray, frame: int, fps: float) -> float:
    """Measure the level speed, m/s, of a root (T, 3) m around a frame."""
    around = int(round(_SPEED_SECONDS * fps))
    first, last = max(frame - around, 0), min(frame + around, len(root) - 1)
    return float(np.linalg.norm(root[last, :2] - root[first, :2]) * fps / max(last - first, 1))


def compute_allowed_step(speed: float) -> float:
    """Compute how far, m, the pelvis of a player at a speed, m/s, may step off its track."""
    return float(np.interp(speed, (SLOW_SPEED, FAST_SPEED), (SLOW_STEP, FAST_STEP)))


def step_to_ball(body: Body, side: str, at: int, need: np.ndarray, share: np.ndarray, fps: float) -> Body:
    """Move the pelvis over feet that stay, towards a ball that a part does not reach.

    Args:
        body: the body, W frames.
        side: of the leg that strikes and need not stand, "" if both stand.
        at: frame of the touch.
        need: (3,) m, what the part lacks there.
        share: (W,) of the step at each frame.
        fps: frames per second.
    Returns:
        The body, unchanged where a standing leg is too short for any step.
    """
    human, level = identify_joints(body.skeleton), np.array([*need[:2], 0.0])
    most = compute_allowed_step(measure_level_speed(body.root, at, fps))
    step = level * min(1.0, most / max(float(np.linalg.norm(level)), 1e-9))
    standing = [getattr(human, name) for name in ("left", "right") if name != side]
    feet = [limb.foot for limb in standing]
    for part in _SHARES:
        root, rotations = body.root + part * share[:, None] * step, body.rotations
        for limb in standing:
            rotations = hold_foot(body, limb, root, rotations)
        stepped = Body.from_pose(body.skeleton, root, rotations)
        if np.linalg.norm(stepped.places[:, feet] - body.places[:, feet], axis=2).max() < _HELD:
            return stepped
    return body
