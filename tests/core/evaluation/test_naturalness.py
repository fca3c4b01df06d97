"""What the eye sees, on planted courses: every figure finds what was planted and nothing else."""

import numpy as np
import pytest

from beyond_mocap.evaluation.naturalness import (
    BodyCourse,
    find_pelvis_drops,
    find_snap_turns,
    find_spins,
    list_event_messages,
    measure_course,
    measure_dwell,
    measure_facing_off_travel,
    measure_head_off_ball,
    measure_standing,
)
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthetic.gait import build_gait

FPS = 30.0


def course(heading=0.0, speed=1.0, travel=0.0, height=0.9, seconds=10.0) -> BodyCourse:
    count = int(seconds * FPS)
    values = [np.broadcast_to(np.asarray(value, float), count).copy() for value in (heading, speed, travel, height)]
    return BodyCourse(FPS, *values, posture=np.zeros((count, 1)))


def ramp(at, seconds, degrees, total=10.0):
    """A heading that turns by some degrees within some seconds, from second `at` on."""
    times = np.arange(int(total * FPS)) / FPS
    return np.radians(degrees) * np.clip((times - at) / seconds, 0.0, 1.0)


@pytest.mark.parametrize("degrees, seconds, snaps, spins", [
    (90.0, 0.2, 1, 0), (60.0, 0.2, 0, 0), (90.0, 0.8, 0, 0), (230.0, 1.8, 0, 1), (-230.0, 0.4, 1, 1),
    (180.0, 1.8, 0, 0),
])
def test_turns(degrees, seconds, snaps, spins):
    body = course(heading=ramp(4.0, seconds, degrees))
    assert len(find_snap_turns(body)) == snaps and len(find_spins(body)) == spins
    assert all(abs(frame / FPS - 4.0 - seconds / 2) < 1.1 for frame in (*find_snap_turns(body), *find_spins(body)))


def test_two_snap_turns_are_two_and_have_a_line():
    body = course(heading=ramp(2.0, 0.2, 100.0) + ramp(6.0, 0.2, -100.0))
    (line,) = list_event_messages(body, 100.0 + np.arange(300) / FPS)
    assert len(find_snap_turns(body)) == 2 and len(line.spans) == 2 and "75 degrees" in line
    assert line.startswith("102.1") and line.spans[1][0] == pytest.approx(106.1, abs=0.1)


@pytest.mark.parametrize("fall, seconds, found", [(0.2, 0.15, 1), (0.1, 0.15, 0), (0.2, 0.6, 0)])
def test_falls_of_the_hips(fall, seconds, found):
    times = np.arange(300) / FPS
    assert len(find_pelvis_drops(course(height=0.9 - fall * np.clip((times - 3.0) / seconds, 0.0, 1.0)))) == found


def test_dwell_counts_slow_pieces_between_cuts():
    body = course(speed=np.where(np.arange(300) < 200, 1.0, 5.0))
    assert measure_dwell(body, np.array([30, 90, 105, 220, 250])).tolist() == [2.0, 0.5, 115 / 30]


def test_facing_off_travel_counts_fast_frames():
    off = measure_facing_off_travel(course(heading=0.5, speed=np.where(np.arange(300) < 100, 1.0, 4.0)))
    assert len(off) == 200 and np.allclose(off, 0.5)


def test_standing():
    track = np.zeros((300, 2))
    track[150:, 0] = np.linspace(0.0, 8.0, 150)
    planted = np.ones((300, 2), bool)
    planted[30:40, 0] = planted[60:70, 1] = planted[200:220] = False
    found = measure_standing(track, planted, FPS)
    assert found["seconds"] == pytest.approx(5.1, abs=0.15)
    assert found["foot_lifts_per_min"] == pytest.approx(2 * 60 / found["seconds"], rel=1e-6)
    assert found["both_down"] == pytest.approx(1.0 - 20 / (FPS * found["seconds"]), rel=1e-6)


def test_a_synthetic_walk():
    motion = build_gait(2.5, 5.0, FPS)
    body = measure_course(motion.skeleton, forward_kinematics(motion)[0], FPS)
    assert np.median(body.speed) == pytest.approx(2.5, rel=0.1)
    assert np.degrees(np.median(measure_facing_off_travel(body))) < 10.0
    assert not find_snap_turns(body) and not find_spins(body) and not find_pelvis_drops(body)


def test_the_head_off_the_ball_counts_balls_within_range():
    motion = build_gait(0.0, 3.0, FPS)
    places, world = forward_kinematics(motion)
    head = identify_joints(motion.skeleton).head
    look = quaternion.rotate(quaternion.inverse(world[0, head]), np.array([1.0, 0.0, 0.0]))
    sight = quaternion.rotate(world[:, head], look)
    ball = places[:, head] + 5.0 * quaternion.rotate_about_up(sight, np.full(len(sight), np.radians(30.0)))
    ball[:20], ball[20:30] = places[:20, head] - 5.0 * sight[:20], np.nan
    found = np.degrees(measure_head_off_ball(motion.skeleton, places, world, ball, look))
    assert len(found) == len(motion) - 30 and np.allclose(found, 30.0, atol=1.0)
