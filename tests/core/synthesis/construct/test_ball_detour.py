"""A ball whose course leads through a body goes round it, smoothly and no farther than it must."""

import numpy as np
import pytest

from beyond_mocap.annotation.body_solid import BodySolid
from beyond_mocap.annotation.body_surfaces import build_body_surfaces
from beyond_mocap.annotation.striking import build_part_surfaces, measure_ball_gap
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import compute_pose
from beyond_mocap.motion.track import BALL_RADIUS
from beyond_mocap.synthesis.construct.ball_detour import find_free_contact, lead_ball_around_body
from beyond_mocap.synthetic.gait import build_gait

FPS = 30.0


@pytest.fixture(scope="module")
def run():
    return build_gait(2.8, 3.0, FPS)


def depths(run, ball):
    posed = compute_pose(run.skeleton, run.root_positions, run.rotations)
    return BodySolid.from_pose(build_body_surfaces(run.skeleton), *posed).measure_depths(ball).max(axis=1)


def passing(run, frame, height, velocity):
    """A straight course through the pelvis' place at a frame, at one height."""
    since = (np.arange(len(run)) - frame)[:, None] / FPS
    return np.array([*run.root_positions[frame, :2], height]) + since * np.array([*velocity, 0.0])


def led(run, ball, held=()):
    return lead_ball_around_body(run.skeleton, run.root_positions, run.rotations, ball, held, FPS)


@pytest.mark.parametrize("height", [BALL_RADIUS, 0.5, 1.0, 1.2, 1.6])
@pytest.mark.parametrize("velocity", [(-2.0, 1.0), (2.8, 2.0), (-12.0, 3.0), (0.0, 25.0)])
def test_a_ball_through_the_body_goes_round(run, height, velocity):
    ball = passing(run, 45, height, velocity)
    out = led(run, ball)
    assert depths(run, out).max() < 0.005
    moved = np.linalg.norm(out - ball, axis=1)
    assert moved.max() < 0.6 and (moved[:25] == 0.0).all() and (moved[70:] == 0.0).all()
    assert out[:, 2].min() >= BALL_RADIUS - 1e-9
    # no kink: the detour grows and fades by less than 4 cm a frame where it is not at a touch
    assert np.abs(np.diff(moved)).max() < 0.12


def test_a_ball_that_passes_outside_keeps_its_bits(run):
    ball = passing(run, 45, 0.11, (-3.0, 0.0)) + [0.0, 1.0, 0.0]
    assert np.array_equal(led(run, ball), ball)
    assert np.isnan(led(run, np.full((len(run), 3), np.nan))).all()


def test_a_touch_stays_and_a_kicked_ball_leaves_away_from_the_body(run):
    ball = passing(run, 45, BALL_RADIUS, (10.0, 0.0))
    out = led(run, ball, [(45, 45)])
    assert np.array_equal(out[45], ball[45])
    assert np.delete(depths(run, out), 45).max() < 0.005


def test_a_contact_inside_another_part_slides_along_the_surface(run):
    places, world = (values[10] for values in compute_pose(run.skeleton, run.root_positions, run.rotations))
    foot = build_part_surfaces(run.skeleton, "foot")[0]
    leg = identify_joints(run.skeleton).left
    ankle, knee = places[[leg.foot, leg.lower_leg]]
    upward = (knee - ankle) / np.linalg.norm(knee - ankle)
    inside = ankle + (foot.radius + BALL_RADIUS) * upward  # on the foot, in the shank
    assert depths(run, np.tile(inside, (len(run), 1)))[10] > 0.05
    out = find_free_contact(run.skeleton, foot, places, world, inside)
    assert depths(run, np.tile(out, (len(run), 1)))[10] < 0.005
    assert abs(measure_ball_gap(foot.compute_line(places, world), foot.radius, out)) < 0.005
    free = out + 0.0
    assert find_free_contact(run.skeleton, foot, places, world, free) is free
