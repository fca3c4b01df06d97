"""Made kicks: the ball goes where it is aimed, sent by the foot that is seen to meet it."""

import numpy as np
import pytest

from beyond_mocap.ball.contact import find_striking_surface
from beyond_mocap.ball.flight import Launch, find_crossing, simulate_flight
from beyond_mocap.ball.physics import FOOTBALL
from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.throws.ball_release import strike_ball
from beyond_mocap.throws.synthetic_examples import generate_kick_at

ASKED = [
    ("right", "instep", (11.0, 0.0, 1.0), 25.0), ("left", "inside", (11.0, 2.0, 0.5), 18.0),
    ("right", "instep", (20.0, -3.0, 1.8), 24.0), ("right", "inside", (8.0, 0.0, 0.3), 15.0),
]  # fmt: skip


@pytest.fixture(scope="module", params=ASKED, ids=lambda asked: f"{asked[0]} {asked[1]}")
def made(request):
    foot, style, target, speed = request.param
    return generate_kick_at(target, speed, foot, style, fps=240.0), np.array(target), speed


def foot_line(motion, foot):
    """Both ends (T, 2, 3) m of the foot's line and their velocities."""
    surface = find_striking_surface(motion.skeleton, "foot", foot)
    ends = np.stack(surface.compute_line(*forward_kinematics(motion)), axis=1)
    return ends, np.gradient(ends, 1.0 / motion.fps, axis=0), surface.radius


def test_the_ball_flies_through_the_target(made):
    kicked, target, speed = made
    assert abs(np.linalg.norm(kicked.velocity) - speed) < 1e-6
    flight = simulate_flight(Launch(0.0, kicked.ball, kicked.velocity, kicked.spin), FOOTBALL, 4.0)
    assert np.linalg.norm(find_crossing(flight, target) - target) < 0.05


def test_the_foot_meets_the_ball_and_gives_it_this_launch(made):
    kicked, _, speed = made
    ends, velocities, radius = foot_line(kicked.motion, kicked.foot)
    frame = kicked.contact * kicked.motion.fps
    low, share = int(frame), frame - int(frame)
    now = [(1.0 - share) * rows[low] + share * rows[low + 1] for rows in (ends, velocities)]
    given = strike_ball(now[0][None], now[1][None], radius, kicked.ball[None], FOOTBALL)
    assert abs(given.gap[0]) < 0.01
    assert np.linalg.norm(given.velocity[0] - kicked.velocity) < 0.06 * speed


def test_the_foot_comes_from_behind_the_ball(made):
    kicked, _, _ = made
    ends, _, radius = foot_line(kicked.motion, kicked.foot)
    before = slice(0, int((kicked.contact - 0.008) * kicked.motion.fps))
    nothing = np.zeros_like(ends[before])
    gaps = strike_ball(ends[before], nothing, radius, np.broadcast_to(kicked.ball, (len(nothing), 3)), FOOTBALL).gap
    assert gaps.min() > -0.005


def test_feet_stand_on_the_ground_and_do_not_slide(made):
    kicked, _, _ = made
    places, _ = forward_kinematics(kicked.motion)
    assert places[..., 2].min() > -0.01
    body = identify_joints(kicked.motion.skeleton)
    standing = body.left if kicked.foot == "right" else body.right
    fps = kicked.motion.fps
    toe = places[int((kicked.contact - 0.05) * fps) : int((kicked.contact + 0.2) * fps), standing.toe]
    assert np.ptp(toe, axis=0).max() < 0.015


def test_knees_bend_the_right_way_and_nothing_is_faster_than_the_foot(made):
    kicked, _, _ = made
    places, _ = forward_kinematics(kicked.motion)
    body = identify_joints(kicked.motion.skeleton)
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=-1) * kicked.motion.fps
    limb = body.right if kicked.foot == "right" else body.left
    assert int(np.argmax(speeds.max(axis=0))) == limb.toe and speeds.max() < 28.0
    peak = int(np.argmax(speeds[:, limb.toe]))
    assert abs(peak / kicked.motion.fps - kicked.contact) < 0.06


def test_a_tall_body_kicks_too():
    tall = generate_kick_at((16.0, 3.0, 1.5), 23.0, skeleton=build_adult_skeleton(2.0))
    places, _ = forward_kinematics(tall.motion)
    assert places[..., 2].min() > -0.01 and places[0, :, 2].max() > 1.6


@pytest.mark.parametrize(
    "wrong", [{"foot": "third"}, {"style": "toe"}, {"speed": 60.0}, {"target": (60.0, 0.0, 2.0)},
              {"target": (4.0, 0.0, 5.0)}]
)
def test_what_cannot_be_kicked_is_told(wrong):
    with pytest.raises(InputError):
        generate_kick_at(**{"speed": 18.0} | wrong)
