"""Synthetic receptions: the part is out before the ball arrives and gives with it; the body goes on."""

import numpy as np
import pytest

from beyond_mocap.annotation.ball_contact import build_surfaces, find_striking_part
from beyond_mocap.annotation.labels import read_labels
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthetic.actions.receptions import (
    LET_RUN_ACTIONS,
    RECEPTION_ACTIONS,
    RECEPTIONS,
    SPEEDS,
    build_reception,
)

FPS = 60.0
FEET = [kind for kind, one in RECEPTIONS.items() if one.foot and "receive" in one.labels]
CASES = [(kind, speed) for kind, one in RECEPTIONS.items() for speed in SPEEDS if one.speeds[0] <= speed
         <= one.speeds[1]]


def trace(kind, speed):
    """The move, its key frame, the ankle and the part's middle relative to the hips."""
    move = build_reception(kind, fps=FPS, speed=speed)
    places, rotations = forward_kinematics(move.motion)
    body = identify_joints(move.motion.skeleton)
    surface = next(one for one in build_surfaces(move.motion.skeleton, (*RECEPTIONS[kind].labels, "right")))
    middle = np.mean(surface.compute_line(places, rotations), axis=0)
    hips = places[:, body.hips]
    return move, int(round(move.key * FPS)), places[:, body.right.foot] - hips, middle - hips, places, body


@pytest.mark.parametrize("kind, speed", [case for case in CASES if case[0] in FEET])
def test_the_foot_is_slow_against_the_pelvis_around_the_touch(kind, speed):
    move, key, ankle, *_ = trace(kind, speed)
    against = np.linalg.norm(np.gradient(ankle, axis=0), axis=1) * FPS
    near = slice(key - 7, key + 8)
    assert against[near].max() < 3.0 and np.median(against[near]) < 2.6
    assert against[key - 36 : key + 36].max() < 1.3 * speed + 5.5  # no backswing: no faster than the leg of a stride
    assert move.start < move.key < move.end <= move.motion.duration


@pytest.mark.parametrize("kind, speed", [case for case in CASES if case[0] not in ("chest", "push", "let run")])
def test_the_part_gives_with_the_ball(kind, speed):
    _, key, _, middle, *_ = trace(kind, speed)
    axis = 2 if kind in ("thigh", "top", "high inside") else 0  # a falling ball is taken down, a rolling one backward
    later = key + int(0.1 * FPS)
    assert 0.03 < middle[key, axis] - middle[later, axis] < 0.35


@pytest.mark.parametrize("speed", [1.8, 3.5, 6.9])
def test_a_first_touch_into_the_run_goes_on_with_the_ball(speed):
    move, key, _, middle, *_ = trace("push", speed)
    assert 0.02 < middle[key + int(0.1 * FPS), 0] - middle[key, 0] < 0.2
    body = np.gradient(move.motion.root_positions[:, 0]) * FPS
    assert body[key - 20 : key + 20].min() > 0.75 * speed  # it hardly slows down


@pytest.mark.parametrize("kind", ["top", "high inside", "thigh"])
@pytest.mark.parametrize("speed", [0.0, 1.2, 1.8, 2.5])
def test_a_high_ball_is_taken_as_calmly(kind, speed):
    move = build_reception(kind, fps=FPS, speed=speed, height=RECEPTIONS[kind].heights[1])
    places, _ = forward_kinematics(move.motion)
    body, key = identify_joints(move.motion.skeleton), int(round(move.key * FPS))
    ankle = places[:, body.right.foot] - places[:, body.hips]
    assert (np.linalg.norm(np.gradient(ankle, axis=0), axis=1) * FPS)[key - 7 : key + 8].max() < 3.0


@pytest.mark.parametrize("speed", [0.0, 1.2, 3.5])
def test_the_other_foot_stands_and_its_knee_is_bent(speed):
    _, key, _, _, places, body = trace("inside", speed)
    standing = places[key - 3 : key + 2, body.left.toe]
    assert np.ptp(standing[:, :2], axis=0).max() < 0.02
    thigh = places[key, body.left.upper_leg] - places[key, body.left.lower_leg]
    shank = places[key, body.left.foot] - places[key, body.left.lower_leg]
    bent = np.pi - np.arccos(thigh @ shank / np.linalg.norm(thigh) / np.linalg.norm(shank))
    assert np.radians(25) < bent < np.radians(60)


def test_every_part_has_a_row_with_its_labels():
    rows = {action.name: action for action in (*RECEPTION_ACTIONS, *LET_RUN_ACTIONS)}
    parts = {kind: find_striking_part(rows[one.name].labels) for kind, one in RECEPTIONS.items()}
    assert parts == {"inside": "foot", "push": "foot", "outside": "foot", "sole": "foot", "top": "foot",
                     "high inside": "foot", "thigh": "thigh", "chest": "chest", "head": "head", "let run": None}
    assert all(action.labels <= set(read_labels()) and (action.speeds or action.heights) for action in rows.values())


def test_a_header_that_takes_the_ball_goes_down_with_it_and_lower_for_a_lower_ball():
    tops = []
    for height in (1.5, 1.75):
        move = build_reception("head", fps=FPS, speed=0.0, height=height)
        places, key = forward_kinematics(move.motion)[0], int(round(move.key * FPS))
        head = places[:, identify_joints(move.motion.skeleton).head_or_neck]
        tops.append(head[key, 2])
        assert head[key, 2] - head[key + 9, 2] > 0.03  # it sinks with the ball
        assert np.linalg.norm(np.gradient(head, axis=0), axis=1)[key - 6 : key + 6].max() * FPS < 1.4  # no strike
    assert 0.1 < tops[1] - tops[0] < 0.3


@pytest.mark.parametrize("speed", [0.0, 3.5])
def test_the_foot_makes_way_for_a_ball_that_is_let_run(speed):
    move = build_reception("let run", fps=FPS, speed=speed)
    places, key = forward_kinematics(move.motion)[0], int(round(move.key * FPS))
    foot = identify_joints(move.motion.skeleton).right.toe_or_foot
    assert places[key - 3 : key + 4, foot, 2].min() > 0.22  # higher than the ball


def test_the_foot_is_lifted_to_a_bouncing_ball():
    heights = []
    for height in (0.11, 0.4):
        move = build_reception("inside", fps=FPS, speed=1.2, height=height)
        places, _ = forward_kinematics(move.motion)
        foot = identify_joints(move.motion.skeleton).right.foot
        heights.append(places[int(round(move.key * FPS)), foot, 2])
    assert heights[1] - heights[0] == pytest.approx(0.15, abs=0.03)
