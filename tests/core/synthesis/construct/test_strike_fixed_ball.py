"""A part brought to a ball that stays: the gap is closed by every part, frames away from it keep their bits."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation.striking import measure_ball_gap
from beyond_mocap.ball.contact import compute_ball_centre, find_striking_surface, sample_strike_surface
from beyond_mocap.motion.humanoid import compute_heading_from_positions
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthesis.construct.strike_fixed_ball import MAX_SHIFT, FixedStrike, strike_fixed_ball
from beyond_mocap.synthetic.volleys import BEFORE, build_volley

FPS = 60.0
AT = int(BEFORE * FPS)
PARTS = {
    "pass": ("foot", "right"), "head": ("head", ""), "chest": ("chest", ""), "hand": ("hand", "right"),
    "racquet": ("tool", "right"), "toss": ("RightLeg", ""),
}  # fmt: skip


def ball_for(motion, surface, off):
    """(3,) m: a ball that the surface would touch at AT, but that it lies `off` m from there."""
    struck = sample_strike_surface(motion, np.array([float(AT)]), surface)
    places, _ = forward_kinematics(motion)
    turn = compute_heading_from_positions(motion.skeleton, places[AT : AT + 1])
    own = compute_ball_centre(struck, np.array([[1.0, 0.0, 0.2]]))[0]
    level = np.array([[np.cos(turn[0]), -np.sin(turn[0])], [np.sin(turn[0]), np.cos(turn[0])]]) @ own[:2]
    return np.array([*(level + places[AT, 0, :2]), own[2]]) + off


def met(motion, surface, ball, radius=0.11):
    standing = np.ones((len(motion), 2), bool)
    standing[AT - 25 : AT + 32, 1] = False
    return strike_fixed_ball(motion, standing, [FixedStrike(float(AT), surface, ball, radius, 30.0, 30.0)])


@pytest.mark.parametrize("kind", sorted(PARTS))
@pytest.mark.parametrize("off", [(0.05, 0.02, 0.0), (-0.03, -0.03, 0.03)])
def test_every_part_meets_the_ball(kind, off):
    motion = build_volley(kind, fps=FPS).motion
    part, side = PARTS[kind]
    surface = find_striking_surface(motion.skeleton, part, side)
    ball = ball_for(motion, surface, off)
    found = met(motion, surface, ball)
    places, world = forward_kinematics(found.motion)
    gap = measure_ball_gap(surface.compute_line(places[AT], world[AT]), surface.radius, ball)
    assert abs(gap) < 0.005 and abs(found.gap[0] - abs(gap)) < 1e-9 and found.moved[0] < 0.12
    away = np.abs(np.arange(len(motion)) - AT) > 31
    assert found.motion.rotations[away].tobytes() == motion.rotations[away].tobytes()


def test_on_the_ground_no_foot_goes_through_it():
    """A foot in the ball, as after bodies were moved: it comes out to the side, not downwards."""
    motion = build_volley("pass", fps=FPS).motion
    surface = find_striking_surface(motion.skeleton, "foot", "right")
    standing = np.ones((len(motion), 2), bool)
    standing[AT - 25 : AT + 32, 1] = False
    own = forward_kinematics(motion)[0][:, surface.end[0], 2]
    low = replace(motion, root_positions=motion.root_positions - [0.0, 0.0, own[AT] - 0.03])  # toes just above ground
    meeting = FixedStrike(float(AT), surface, ball_for(low, surface, (-0.1, 0.0, 0.03)), 0.11, 30.0, 30.0)
    free, held = (strike_fixed_ball(low, standing, [meeting], has_ground=grounded) for grounded in (False, True))
    toes = [forward_kinematics(found.motion)[0][AT, surface.end[0], 2] for found in (free, held)]
    assert toes[0] < 0.0 < toes[1] and held.gap[0] < 0.005


def test_it_comes_and_goes_smoothly():
    """Not more jerk of the foot than the swing itself has."""
    motion = build_volley("pass", fps=FPS).motion
    surface = find_striking_surface(motion.skeleton, "foot", "right")
    found = met(motion, surface, ball_for(motion, surface, (0.05, 0.03, 0.04)))
    foot = surface.start[0]
    own, moved = (np.abs(np.diff(forward_kinematics(m)[0][:, foot], 2, axis=0)).max() for m in (motion, found.motion))
    assert moved < 1.5 * own


def test_a_ball_out_of_reach_is_told_and_one_that_is_missed_left():
    motion = build_volley("pass", fps=FPS).motion
    surface = find_striking_surface(motion.skeleton, "foot", "right")
    far = met(motion, surface, ball_for(motion, surface, (1.5, 0.0, 0.5)))
    assert far.gap[0] > 0.3 and far.moved[0] <= MAX_SHIFT + 1e-9
    missed = met(motion, surface, np.full(3, np.nan))
    assert np.isnan(missed.gap[0]) and missed.motion.rotations.tobytes() == motion.rotations.tobytes()


def test_a_smaller_ball_is_met_by_its_own_surface():
    motion = build_volley("racquet", fps=FPS).motion
    surface = find_striking_surface(motion.skeleton, "tool", "right")
    found = met(motion, surface, ball_for(motion, surface, (0.02, 0.01, 0.0)), radius=0.033)
    assert found.gap[0] < 0.005
