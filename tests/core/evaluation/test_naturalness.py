"""What the eye sees, on planted courses and motions: every figure finds what was planted and nothing else."""

import numpy as np
import pytest

from beyond_mocap.evaluation.naturalness import (
    BodyCourse,
    find_pelvis_drops,
    find_snap_turns,
    find_spins,
    find_stands,
    list_event_messages,
    list_steady_strides,
    measure_course,
    measure_course_figures,
    measure_dwell,
    measure_facing_off_travel,
    measure_head_off_ball,
    measure_piece_figures,
    measure_standing,
    measure_tempo,
    select_unasked_spins,
)
from beyond_mocap.library.posture import NormalPostures
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion, forward_kinematics
from beyond_mocap.motion.quaternion import from_up_angle, inverse, multiply, rotate, rotate_about_up
from beyond_mocap.synthetic.gait import build_gait

FPS = 30.0


def course(heading=0.0, speed=1.0, travel=0.0, height=0.9, seconds=10.0, posture=0.0, stride=0.0) -> BodyCourse:
    count = int(seconds * FPS)
    values = [np.broadcast_to(np.asarray(value, float), count).copy() for value in (heading, speed, travel, height)]
    return BodyCourse(FPS, *values, posture=np.broadcast_to(np.asarray(posture, float), count)[:, None].copy(),
                      stride=np.broadcast_to(np.asarray(stride, float), count).copy())


def ramp(at, seconds, degrees, total=10.0):
    """A heading that turns by some degrees within some seconds, from second `at` on."""
    times = np.arange(int(total * FPS)) / FPS
    return np.radians(degrees) * np.clip((times - at) / seconds, 0.0, 1.0)


def figures(*courses, used=None, asked=None, postures=None):
    """The shared figures of courses, all frames used and none asked by default."""
    every = [np.ones(len(one.heading), bool) for one in courses]
    none = [np.zeros(len(one.heading), bool) for one in courses]
    return measure_course_figures(courses, used or every, asked or none, postures or NormalPostures({}))


@pytest.mark.parametrize("degrees, seconds, snaps, spins", [
    (90.0, 0.2, 1, 0), (60.0, 0.2, 0, 0), (90.0, 0.8, 0, 0), (230.0, 1.8, 0, 1), (-230.0, 0.4, 1, 1),
    (180.0, 1.8, 0, 0), (76.0, 0.3, 1, 0), (74.0, 0.3, 0, 0), (202.0, 2.0, 0, 1), (198.0, 2.0, 0, 0),
])
def test_turns(degrees, seconds, snaps, spins):
    body = course(heading=ramp(4.0, seconds, degrees))
    assert len(find_snap_turns(body)) == snaps and len(find_spins(body)) == spins
    assert all(abs(frame / FPS - 4.0 - seconds / 2) < 1.1 for frame in (*find_snap_turns(body), *find_spins(body)))


def test_a_turn_that_slows_down_for_a_moment_is_one_spin():
    body = course(heading=ramp(2.0, 1.5, 205.0) + ramp(4.1, 1.5, 205.0))
    turned = [np.abs(np.diff(body.heading[[first, first + 60]]))[0] > np.radians(200.0) for first in range(240)]
    assert np.count_nonzero(np.diff(np.array(turned, int)) == 1) == 2 and len(find_spins(body)) == 1


def test_two_snap_turns_are_two_and_have_a_line():
    body = course(heading=ramp(2.0, 0.2, 100.0) + ramp(6.0, 0.2, -100.0))
    ((line,), notes) = list_event_messages(body, 100.0, None, np.zeros(300, bool))
    assert len(find_snap_turns(body)) == 2 and len(line.spans) == 2 and "75 degrees" in line and notes == []
    assert line.startswith("102.1, 106.1 s: ") and line.spans[1][0] == pytest.approx(106.1, abs=0.1)


@pytest.mark.parametrize("planned, asked", [
    (ramp(4.2, 1.8, 210.0), True),  # the plan makes the same turn, a little later
    (ramp(4.0, 1.8, 180.0), True),  # and may be off by 25 degrees
    (ramp(4.0, 1.8, 150.0), False),
    (ramp(4.0, 1.8, -210.0), False),  # the other way round
    (ramp(7.5, 1.8, 210.0), False),  # another time
])
def test_a_spin_that_the_plan_contains_is_a_note(planned, asked):
    body = course(heading=ramp(4.0, 1.8, 230.0))
    warnings, notes = list_event_messages(body, 0.0, planned, np.zeros(300, bool))
    assert len(select_unasked_spins(body, planned)) == (not asked)
    assert (len(warnings), len(notes)) == ((0, 1) if asked else (1, 0))
    assert all("as ball and play ask" in line and line.spans for line in notes)


@pytest.mark.parametrize("fall, seconds, found", [(0.2, 0.15, 1), (0.1, 0.15, 0), (0.2, 0.6, 0)])
def test_falls_of_the_hips(fall, seconds, found):
    times = np.arange(300) / FPS
    assert len(find_pelvis_drops(course(height=0.9 - fall * np.clip((times - 3.0) / seconds, 0.0, 1.0)))) == found


@pytest.mark.parametrize("action", [(2.5, 4.0), (5.0, 6.0)])
def test_falls_within_an_action_are_notes_and_none_of_locomotion(action):
    times = np.arange(300) / FPS
    body = course(height=0.9 - 0.2 * np.clip((times - 3.0) / 0.15, 0.0, 1.0))
    asked, within = (times >= action[0]) & (times < action[1]), action[0] < 3.0
    found = figures(body, asked=[asked])
    assert found["pelvis_drops_per_min"] == pytest.approx(6.0)
    assert found["pelvis_drops_in_locomotion_per_min"] == pytest.approx(0.0 if within else 6.0)
    warnings, notes = list_event_messages(body, 0.0, None, asked)
    assert (len(warnings), len(notes)) == ((0, 1) if within else (1, 0))


def test_dwell_counts_slow_pieces_between_cuts():
    body = course(speed=np.where(np.arange(300) < 200, 1.0, 5.0))
    cuts = np.array([30, 90, 105, 220, 250]) / FPS
    assert measure_dwell(body, cuts) == pytest.approx([2.0, 0.5, 115 / 30])
    found = measure_piece_figures(body, cuts)
    assert found["cuts_per_min"] == pytest.approx(30.0) and found["slow_pieces"] == 3
    assert found["dwell_s_median"] == pytest.approx(2.0) and found["short_dwell_share"] == 0.0
    assert np.isnan(measure_piece_figures(body, np.array([2.0]))["dwell_s_median"])


def test_facing_off_travel_counts_fast_frames():
    body = course(heading=0.5, speed=np.where(np.arange(300) < 100, 1.0, 4.0))
    off = measure_facing_off_travel(body)
    assert np.isfinite(off).sum() == 200 and np.allclose(off[100:], 0.5)
    found = figures(body)
    assert found["fast_frames"] == 200 and found["off_travel_deg_median"] == pytest.approx(np.degrees(0.5))
    assert np.isnan(figures(course(speed=1.0))["off_travel_deg_p90"])


def test_body_language_counts_slow_frames_that_nobody_asked_for():
    frames = np.arange(300)
    body = course(speed=np.where(frames < 200, 1.0, 4.0), posture=np.where(frames % 4 == 0, 9.0, 0.0))
    postures = NormalPostures({1: (np.zeros(1), np.eye(1), 1.0)})
    found = figures(body, postures=postures)
    assert found["unusual_posture_share"] == 0.25 and found["slow_frames"] == 200
    asked = figures(body, postures=postures, asked=[frames < 100])
    assert asked["unusual_posture_share"] == 0.25 and asked["slow_frames"] == 100
    assert figures(body, postures=postures, asked=[frames % 4 == 0])["unusual_posture_share"] == 0.0
    unknown = figures(body, postures=NormalPostures({3: (np.zeros(1), np.eye(1), 1.0)}))
    assert np.isnan(unknown["unusual_posture_share"]) and unknown["slow_frames"] == 0  # none to compare with


def test_own_figures_rest_on_the_used_frames():
    turning, still = course(heading=ramp(2.0, 0.2, 100.0) + ramp(8.0, 0.2, 100.0)), course()
    first_half = np.arange(300) < 150
    found = figures(turning, still, used=[first_half, np.zeros(300, bool)])
    assert found["frames"] == 150 and found["snap_turns_per_min"] == pytest.approx(60.0 / 5.0)
    empty = figures(turning, used=[np.zeros(300, bool)])
    assert empty["frames"] == 0 and np.isnan(empty["snap_turns_per_min"])


def test_standing():
    track = np.zeros((300, 2))
    track[150:, 0] = np.linspace(0.0, 8.0, 150)
    planted = np.ones((300, 2), bool)
    planted[30:40, 0] = planted[60:70, 1] = planted[200:220] = False
    found = measure_standing(find_stands(track, FPS), planted, FPS)
    assert found["seconds"] == pytest.approx(5.1, abs=0.15)
    assert found["foot_lifts_per_min"] == pytest.approx(2 * 60 / found["seconds"], rel=1e-6)
    assert found["both_down"] == pytest.approx(1.0 - 20 / (FPS * found["seconds"]), rel=1e-6)


def test_a_stand_fits_a_box_of_10_cm_half_diagonal_for_a_second_and_a_half():
    times = np.arange(300) / FPS
    sway = np.sin(2 * np.pi * times)[:, None] * [1.0, 0.0]
    assert find_stands(0.098 * sway, FPS).all() and not find_stands(0.3 * sway, FPS).any()
    short = np.where((times < 1.4)[:, None], 0.0, 5.0 * (times - 1.4)[:, None]) * [1.0, 0.0]
    assert not find_stands(short, FPS).any()


def strides(periods):
    """Feet that pass each other with these stride periods in seconds, again and again for 10 s."""
    passes = np.append(0.0, np.cumsum(np.tile(periods, 12))) - 0.1
    return 0.4 * np.sin(2 * np.pi * np.interp(np.arange(300) / FPS, passes, np.arange(len(passes))))


@pytest.mark.parametrize("periods, deviation", [
    ([0.64, 0.64], 0.0),
    ([0.6333, 0.6333], 0.0),  # no multiple of a frame
    ([0.60, 0.66], 30.0),
])
def test_tempo_is_the_deviation_of_the_stride_period(periods, deviation):
    found = measure_tempo([course(speed=5.0, stride=strides(periods))], [np.ones(300, bool)])
    # half of the strides, those of the right foot, begin in the middle of the periods: they are all alike
    assert found["sd_ms"] == pytest.approx(deviation / np.sqrt(2), abs=2.0)
    assert 26 <= found["strides"] <= 31


def test_tempo_needs_steady_running_above_4_m_s():
    periods = [0.64]
    assert list_steady_strides(course(speed=3.8, stride=strides(periods))) == []
    assert list_steady_strides(course(speed=np.linspace(4.0, 12.0, 300), stride=strides(periods))) == []
    found = measure_tempo([course(speed=5.0, stride=strides(periods))], [np.zeros(300, bool)])
    assert found["strides"] == 0 and np.isnan(found["sd_ms"])


def test_a_synthetic_run_has_a_steady_tempo():
    motion = build_gait(6.0, 6.0, FPS)
    body = measure_course(motion.skeleton, forward_kinematics(motion)[0], FPS)
    found = measure_tempo([body], [np.ones(len(body.heading), bool)])
    assert found["strides"] > 10 and found["sd_ms"] < 10.0


def test_a_synthetic_walk():
    motion = build_gait(2.5, 5.0, FPS)
    body = measure_course(motion.skeleton, forward_kinematics(motion)[0], FPS)
    assert np.median(body.speed) == pytest.approx(2.5, rel=0.1)
    assert np.degrees(np.nanmedian(measure_facing_off_travel(body))) < 10.0
    assert not find_snap_turns(body) and not find_spins(body) and not find_pelvis_drops(body)


def turning(fps, seconds=8.0):
    """A walk at 2.4 m/s whose body snaps by 100 degrees at 3 s, turns by 230 within 1.8 s from 5 s on, and drops."""
    motion = build_gait(2.4, seconds, fps)
    times = np.arange(len(motion)) / fps
    angle = np.radians(100.0 * np.clip((times - 3.0) / 0.2, 0.0, 1.0) + 230.0 * np.clip((times - 5.0) / 1.8, 0.0, 1.0))
    rotations, root = motion.rotations.copy(), motion.root_positions.copy()
    rotations[:, 0] = multiply(from_up_angle(angle), rotations[:, 0])
    root[:, 2] -= 0.2 * (np.clip((times - 1.0) / 0.15, 0.0, 1.0) - np.clip((times - 1.5) / 1.0, 0.0, 1.0))
    return Motion(motion.skeleton, root, rotations, fps)


@pytest.mark.parametrize("fps", [24.0, 25.0, 30.0, 50.0, 60.0, 120.0])
def test_other_rates_measure_the_same(fps):
    motion = turning(fps)
    body = measure_course(motion.skeleton, forward_kinematics(motion)[0], fps)
    (snap,), (spin,), (drop,) = find_snap_turns(body), find_spins(body), find_pelvis_drops(body)
    assert body.fps == FPS and len(body.heading) == pytest.approx(8.0 * FPS, abs=2)
    assert body.times[[snap, spin, drop]] == pytest.approx([3.1, 5.9, 1.0], abs=0.15)
    assert np.ptp(body.heading) == pytest.approx(np.radians(330.0), abs=0.15)
    usual = turning(FPS)
    same = measure_course(usual.skeleton, forward_kinematics(usual)[0], FPS)
    assert figures(body)["off_travel_deg_p90"] == pytest.approx(figures(same)["off_travel_deg_p90"], abs=3.0)


def test_lengths_are_brought_to_a_leg_of_86_cm():
    motion = turning(FPS)
    positions = forward_kinematics(motion)[0]
    small = measure_course(motion.skeleton, positions, FPS)
    tall = measure_course(motion.skeleton.scale(1.3), 1.3 * positions, FPS)
    np.testing.assert_allclose(tall.pelvis_height, small.pelvis_height)
    np.testing.assert_allclose(tall.speed, small.speed)


def test_the_heading_is_across_hips_and_shoulders():
    motion = build_gait(0.0, 1.0, FPS)
    names = motion.skeleton.names
    positions = forward_kinematics(motion)[0]
    straight = measure_course(motion.skeleton, positions, FPS).heading
    spine = next(index for index, name in enumerate(names) if "Spine" in name)
    rotations = motion.rotations.copy()
    rotations[:, spine] = multiply(from_up_angle(np.full(len(motion), np.radians(40.0))), rotations[:, spine])
    twisted = Motion(motion.skeleton, motion.root_positions, rotations, FPS)
    turned = np.degrees(measure_course(motion.skeleton, forward_kinematics(twisted)[0], FPS).heading - straight)
    assert np.all(turned > 10.0) and np.all(turned < 35.0)  # the shoulders alone are turned by 40, the hips by 0


def test_the_head_off_the_ball_counts_balls_within_range():
    motion = build_gait(0.0, 3.0, FPS)
    places, world = forward_kinematics(motion)
    head = identify_joints(motion.skeleton).head
    look = rotate(inverse(world[0, head]), np.array([1.0, 0.0, 0.0]))
    sight = rotate(world[:, head], look)
    ball = places[:, head] + 5.0 * rotate_about_up(sight, np.full(len(sight), np.radians(30.0)))
    ball[:20], ball[20:30] = places[:20, head] - 5.0 * sight[:20], np.nan
    found = np.degrees(measure_head_off_ball(motion.skeleton, places, world, ball, look))
    assert len(found) == len(motion) - 30 and np.allclose(found, 30.0, atol=1.0)
