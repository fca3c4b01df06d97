"""Let a slow body go where its feet carry it, near its track rather than on it.

Tracks are off by some 8 cm, more than a standing or creeping player moves. There the body follows its recording: root
and heading move such that the feet that are in contact stay where they are, also through cuts, and only what takes the
body too far from its planned place and heading is taken back. At speed the track rules.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base.banded_least_squares import BandedLeastSquares
from ...base.vectors import measure_lengths
from ...motion import quaternion
from ...motion.foot_plant import compute_contact_weights
from ...motion.humanoid import identify_joints, pose_legs
from ...motion.skeleton import Skeleton
from ...motion.track import SampledTrack
from ..search.source_frames import SourceMotion
from .track_following import add_sway

SPEEDS = (0.1, 0.5, 1.1)
"""Metres per second of the track below which a body is slow, and above which it is at speed."""

RETURN_SECONDS = (20.0, 0.5, 0.004)
"""How soon the body returns to its track at SPEEDS: at speed at once, slow and in place hardly."""

REST_FIRMNESS = 150.0  # how many times firmer than in a step both feet hold a slow body
_GIVEN_WEIGHT = 1e6  # of a given place, so large that it stays
_HELD_SECONDS = 0.1  # how soon it returns from beyond that
_ROUNDS = 3  # of holding what is beyond
# Weights of the recording's own move and turn against a metre of a foot in contact: they decide what feet leave open.
_OWN_MOVE, _OWN_TURN = 1e-3, 1e-4

_SWIVEL = np.radians(45.0)
"""Rad/s by which feet in contact may turn a body beyond its recording. More comes from a cut between two stances: a
person gets from one to the other with a step and does not swivel on both feet."""


def measure_foot_moves(skeleton: Skeleton, source: SourceMotion, fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Measure how a body has to move from frame to frame so that its feet in contact stay.

    Args:
        skeleton: the skeleton.
        source: T source frames without jumps.
        fps: frames per second.
    Returns:
        (T - 1, 2) m of the root in the facing frame of the frame before, and (T - 1,) rad of turning.
    """
    body, count = identify_joints(skeleton), len(source.clip)
    root = np.column_stack([np.zeros((count, 2)), source.height])
    places, _ = pose_legs(skeleton, root, source.pose)
    joints = [joint for limb in (body.left, body.right) for joint in (limb.foot, limb.toe_or_foot)]
    points = places[:, joints, :2]
    firm = np.concatenate([compute_contact_weights(source.heel_toe_contacts[:, side]) for side in (0, 1)], axis=1)
    weight = np.minimum(firm[1:], firm[:-1])
    before, after = points[:-1], points[1:]
    sway = np.diff(source.sway, axis=0)
    own_move = 0.5 * (source.velocity[1:] + source.velocity[:-1]) / fps + sway
    own_turn = source.turn[1:]
    # Unknown move d and turn f of each step: sum w |d + f J a' + a' - a|^2 with J a quarter turn, and the own ones
    arm = np.stack([-after[..., 1], after[..., 0]], axis=-1)
    miss = before - after
    matrix, right = np.zeros((count - 1, 3, 3)), np.zeros((count - 1, 3))
    matrix[:, 0, 0] = matrix[:, 1, 1] = weight.sum(axis=1) + _OWN_MOVE
    matrix[:, 2, 2] = np.einsum("tp,tpc,tpc->t", weight, arm, arm) + _OWN_TURN
    matrix[:, :2, 2] = matrix[:, 2, :2] = np.einsum("tp,tpc->tc", weight, arm)
    right[:, :2] = np.einsum("tp,tpc->tc", weight, miss) + _OWN_MOVE * own_move
    right[:, 2] = np.einsum("tp,tpc,tpc->t", weight, arm, miss) + _OWN_TURN * own_turn
    turn = np.linalg.solve(matrix, right[..., None])[:, 2, 0]
    turn = own_turn + np.clip(turn - own_turn, -_SWIVEL / fps, _SWIVEL / fps)
    # the first two rows of the system give the best move with that turn
    return (right[:, :2] - matrix[:, :2, 2] * turn[:, None]) / matrix[:, :1, 0], turn


def measure_rest(source: SourceMotion, speed: np.ndarray) -> np.ndarray:
    """Measure how firmly feet hold a body: (T,) REST_FIRMNESS where a slow one has both on the ground, 1 elsewhere.

    What has to be made up for is left to the steps, where it is not seen.
    """
    slow = np.interp(speed, SPEEDS[:2], (1.0, 0.0))
    return 1.0 + (REST_FIRMNESS - 1.0) * slow * source.heel_toe_contacts.any(axis=2).all(axis=1)


def settle_on_track(
    track: SampledTrack, source: SourceMotion, moves: np.ndarray, heading: np.ndarray, given: np.ndarray
) -> SampledTrack:
    """Let a slow body move as its feet carry it, near its track.

    Args:
        track: T frames.
        source: its source frames.
        moves: (T - 1, 2) m of the root, facing frame (`measure_foot_moves`).
        heading: (T,) rad.
        given: (T, 2) m, world, where the root has to be, NaN where it is free.
    Returns:
        The track with places that the body can reach; at speed they stay.
    """
    if len(track) < 2:
        return track
    steps = quaternion.rotate_level(moves, heading[:-1])
    # the root with its sway is what feet carry
    planned = add_sway(track.positions, source.sway, heading)
    seconds = np.interp(track.speed, SPEEDS, RETURN_SECONDS)
    firm, is_given = measure_rest(source, track.speed)[1:], np.isfinite(given).all(axis=1)
    weight = np.where(is_given, _GIVEN_WEIGHT, (seconds * track.fps) ** -2.0)
    goal = root = np.where(is_given[:, None], given, planned)
    for _ in range(_ROUNDS + 1):
        root = _follow_steps(steps, firm, weight, goal)
        off = root - planned
        away = measure_lengths(off)
        beyond = (away > track.leeway) & ~is_given
        weight = np.where(beyond, np.maximum(weight, (_HELD_SECONDS * track.fps) ** -2.0), weight)
        share = track.leeway / np.maximum(away, track.leeway)
        goal = np.where(beyond[:, None], planned + share[:, None] * off, goal)
    moved = root - planned
    return replace(track, positions=track.positions + moved, raw=track.raw + moved)


def _follow_steps(steps: np.ndarray, firm: np.ndarray, weight: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Solve for places (T, 2) that move by steps (T - 1, 2) with weights firm (T - 1,), near goals with weight (T,)."""
    squares = BandedLeastSquares(len(goal), reach=1, columns=2)
    squares.add_value(weight, goal=goal)
    squares.add_difference(1, firm)
    squares.right[1:] += firm[:, None] * steps
    squares.right[:-1] -= firm[:, None] * steps
    return squares.solve()
