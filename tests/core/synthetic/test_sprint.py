"""A synthetic sprint has a sprinter's form, and its centre of mass flies between contacts."""

from __future__ import annotations

import numpy as np
import pytest

from beyond_mocap.base.time_series import find_runs
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import compute_heading_from_positions, identify_joints, measure_leg_length
from beyond_mocap.motion.mass import compute_centre_of_mass
from beyond_mocap.motion.motion import Motion, compute_end_positions, forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.motion.supports import GRAVITY
from beyond_mocap.synthetic import gait_tables
from beyond_mocap.synthetic.gait import build_gait, plan_footsteps
from beyond_mocap.synthetic.gait_plan import GaitStyle, plan_gait

FPS = 60.0
SPEEDS = (6.0, 7.0, 8.0, 9.0)
GAINING = np.linspace(5.0, 9.0, 160)


def bend(motion: Motion, first: str, second: str, third: str) -> np.ndarray:
    """Flexion (T, 2) in degrees of the joint `second` of both sides."""
    places, body = forward_kinematics(motion)[0], identify_joints(motion.skeleton)
    limbs = (body.left, body.right)
    upper, lower = (np.stack([places[:, getattr(limb, b)] - places[:, getattr(limb, a)] for limb in limbs], axis=1)
                    for a, b in ((first, second), (second, third)))
    cross, dot = np.linalg.norm(np.cross(upper, lower), axis=-1), np.sum(upper * lower, axis=-1)
    return np.degrees(np.arctan2(cross, dot))


def trunk_lean(motion: Motion) -> np.ndarray:
    """Forward lean (T,) in degrees of the line from hips to neck."""
    places, body = forward_kinematics(motion)[0], identify_joints(motion.skeleton)
    hips = 0.5 * (places[:, body.left.upper_leg] + places[:, body.right.upper_leg])
    facing = compute_heading_from_positions(motion.skeleton, places)
    trunk = places[:, body.neck_or_chest] - hips
    return np.degrees(np.arctan2(quaternion.rotate_level(trunk[:, :2], -facing)[:, 0], trunk[:, 2]))


def flight_accelerations(motion: Motion, speed) -> np.ndarray:
    """Accelerations (F, 3) m/s^2 of the centre of mass within each flight, by a parabola."""
    plan = plan_gait(speed, None if np.ndim(speed) else motion.duration, FPS, build_neutral_stance(motion.skeleton))
    times = plan.times[plan.requested_slice]
    stands = [plan_footsteps(plan, build_neutral_stance(motion.skeleton), GaitStyle(), side).is_in_contact(times)
              for side in (0, 1)]
    mass = compute_centre_of_mass(identify_joints(motion.skeleton), forward_kinematics(motion)[0])
    return np.array([2.0 * np.polyfit(times[a:b], mass[a:b], 2)[0] for a, b in find_runs(~(stands[0] | stands[1]))
                     if b - a >= 5])


@pytest.mark.parametrize("speed", [4.8, *SPEEDS, 9.5, GAINING, GAINING[::-1]])
def test_the_centre_of_mass_flies_between_contacts(speed):
    motion = build_gait(speed, None if np.ndim(speed) else 4.0, FPS)
    found = flight_accelerations(motion, speed)
    assert len(found) >= 8
    assert np.max(np.abs(found - [0.0, 0.0, -GRAVITY])) < 0.15


def test_the_centre_of_mass_flies_in_a_bend():
    speed = np.full(240, 7.0)
    motion = build_gait(speed, None, FPS, turn_rate=0.5)
    neutral = build_neutral_stance(motion.skeleton)
    plan = plan_gait(speed, None, FPS, neutral, turn_rate=0.5)
    times = plan.times[plan.requested_slice]
    air = ~np.any([plan_footsteps(plan, neutral, GaitStyle(), side).is_in_contact(times) for side in (0, 1)], axis=0)
    mass = compute_centre_of_mass(identify_joints(motion.skeleton), forward_kinematics(motion)[0])
    pushes = [np.hypot(*(2.0 * np.polyfit(times[a:b], mass[a:b], 2)[0][:2])) for a, b in find_runs(air) if b - a >= 5]
    assert np.max(pushes) < 0.15  # the bend asks for 3.5 m/s^2, which contacts give


@pytest.mark.parametrize("speed, knee, lift", [(5.2, (122, 135), (0.50, 0.65)), (7.0, (139, 151), (0.67, 0.79)),
                                               (9.4, (139, 151), (0.65, 0.79))])
def test_heels_rise_as_recorded(speed, knee, lift):
    motion = build_gait(speed, 4.0, FPS)
    places, body = forward_kinematics(motion)[0], identify_joints(motion.skeleton)
    ankle = places[:, [body.left.foot, body.right.foot], 2] * 0.86 / measure_leg_length(motion.skeleton)
    assert knee[0] < bend(motion, "upper_leg", "lower_leg", "foot").max() < knee[1]
    assert lift[0] < np.ptp(ankle) < lift[1]


@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("style", [GaitStyle(), GaitStyle(lean=0.1, elbow=0.35), GaitStyle(lean=-0.1, elbow=-0.35)])
def test_trunk_and_elbows_of_any_style_are_a_sprinters(speed, style):
    motion = build_gait(speed, 4.0, FPS, style=style)
    assert -2.0 < trunk_lean(motion).mean() < 8.0
    elbows = bend(motion, "upper_arm", "lower_arm", "hand")
    assert 39.0 < elbows.min() and elbows.max() < 136.0
    assert np.ptp(elbows) > 70.0  # they work


def test_whoever_stoops_in_standing_sprints_upright():
    upright = build_gait(0.0, 2.0, FPS)
    body = identify_joints(upright.skeleton)
    rotations = upright.rotations.copy()
    rotations[:, body.spine[0]] = quaternion.multiply(
        rotations[:, body.spine[0]], quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.radians(12.0)))
    stooping = Motion(upright.skeleton, upright.root_positions, rotations, FPS)
    for speed, least, most in ((3.0, 12.0, 30.0), (7.0, -2.0, 8.0)):
        motion = build_gait(speed, 3.0, FPS, upright.skeleton, example=stooping)
        assert least < trunk_lean(motion).mean() < most


@pytest.mark.parametrize("speed", [5.5, *SPEEDS])
def test_steps_at_a_steady_speed_are_even(speed):
    neutral = build_neutral_stance(build_adult_skeleton())
    plan = plan_gait(speed, 12.0, FPS, neutral)
    for side in (0, 1):
        steps = plan_footsteps(plan, neutral, GaitStyle(), side)
        assert np.std(np.diff(steps.on)) < 0.010 and np.std(steps.off - steps.on) < 0.005


@pytest.mark.parametrize("speed", [5.0, *SPEEDS, 9.5])
def test_contacts_last_as_long_as_published(speed):
    neutral = build_neutral_stance(build_adult_skeleton())
    plan = plan_gait(speed, 4.0, FPS, neutral, style=GaitStyle(life=0.0))
    steps = plan_footsteps(plan, neutral, GaitStyle(life=0.0), 0)
    published = np.interp(speed, [4.5, 6.0, 7.0, 8.0, 9.0, 9.5], [0.200, 0.160, 0.143, 0.125, 0.112, 0.106])
    assert np.median(steps.off - steps.on) == pytest.approx(published, rel=0.05)


@pytest.mark.parametrize("speed", [*SPEEDS, GAINING, GAINING[::-1]])
def test_hips_keep_their_height_and_no_sole_goes_below_the_ground(speed):
    motion = build_gait(speed, None if np.ndim(speed) else 4.0, FPS)
    places, body = forward_kinematics(motion)[0], identify_joints(motion.skeleton)
    assert min(places[..., 2].min(), compute_end_positions(motion)[..., 2].min()) > -0.003
    hips = 0.5 * (places[:, body.left.upper_leg, 2] + places[:, body.right.upper_leg, 2])
    assert 0.91 < hips.min() / measure_leg_length(motion.skeleton) and np.ptp(hips) < 0.13


@pytest.mark.parametrize("speed", [1.4, 2.6, 3.9, np.concatenate([np.linspace(0.0, 3.9, 90), np.linspace(3.9, 1, 60)])])
def test_walking_and_jogging_do_not_depend_on_a_sprinters_form(speed, monkeypatch):
    motion = build_gait(speed, None if np.ndim(speed) else 3.0, FPS)
    for name, figures in gait_tables._SPRINT_SPEEDS.items():
        monkeypatch.setitem(gait_tables._SPRINT_SPEEDS, name, [(x, 2.0 * y + 1.0) for x, y in figures])
    gait_tables._build_sprint_curve.cache_clear()
    again = build_gait(speed, None if np.ndim(speed) else 3.0, FPS)
    gait_tables._build_sprint_curve.cache_clear()
    assert np.array_equal(motion.rotations, again.rotations)
    assert np.array_equal(motion.root_positions, again.root_positions)


@pytest.mark.parametrize("speed", [7.0, 9.0])
def test_toes_stay_up_until_just_before_they_land(speed):
    """A toe that is down early skims the grass at twice the body's speed: recorded sprinters' are 11 to 17 cm up."""
    motion = build_gait(speed, 4.0, 120.0)
    toes = forward_kinematics(motion)[0][:, [identify_joints(motion.skeleton).left.toe,
                                             identify_joints(motion.skeleton).right.toe], 2]
    heights = toes - np.percentile(toes, 3, axis=0)
    landings = [(begin, side) for side in (0, 1) for begin, _ in find_runs(heights[:, side] < 0.015)
                if begin > 16 and heights[begin - 12 : begin, side].max() > 0.05]
    assert len(landings) >= 8
    before = np.array([heights[begin - 8 : begin - 3, side] for begin, side in landings])  # 67 to 33 ms
    assert before.min() > 0.075
