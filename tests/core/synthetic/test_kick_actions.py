"""Kicks for libraries without any: as hard as the ball, as high as it, the plant foot beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.library.missing_actions import ActionMoment, find_action, find_action_paths
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.synthetic.actions.action import ActionSetting
from beyond_mocap.synthetic.actions.kick_table import KICK_ACTIONS
from beyond_mocap.synthetic.running_kicks import Swing, measure_foot_speed, measure_plant_foot

FPS = 60.0
ADULT = ActionSetting(skeleton=build_adult_skeleton(), fps=FPS)
BODY = identify_joints(ADULT.skeleton)
ROWS = {action.name: action for action in KICK_ACTIONS}


def build(name: str, **situation) -> Swing:
    gesture = ROWS[name].build(replace(ADULT, **situation))
    return Swing(motion=gesture.motion, contact=gesture.key * FPS)


def ask(*words: str, **situation) -> ActionMoment:
    return ActionMoment(labels=frozenset(words), **situation)


@pytest.mark.parametrize("name", ["inside kick on the run", "inside kick in a walk", "inside kick from a stand"])
def test_a_faster_ball_is_kicked_harder(name):
    speed = ROWS[name].speeds[0] if ROWS[name].speeds else 0.0
    pass_, shot = (measure_foot_speed(build(name, speed=speed, exit_speed=ball)) for ball in (9.0, 18.0))
    assert 9.0 / 1.3 < pass_ < 9.0 / 1.06 and shot > 1.4 * pass_


@pytest.mark.parametrize("name", [name for name in ROWS if name.endswith(("on the run", "in a walk"))])
def test_the_plant_foot_is_beside_the_ball(name):
    ahead, beside = measure_plant_foot(build(name, speed=ROWS[name].speeds[-1], exit_speed=18.0))
    assert 0.2 <= beside <= 0.37 and -0.05 <= ahead <= 0.2


def test_the_foot_is_as_high_as_the_ball():
    heights = []
    for height in (0.1, 0.4):
        swing = build("volley on the run", speed=3.2, height=height)
        heights.append(forward_kinematics(swing.motion)[0][round(swing.contact), BODY.right.foot, 2])
    assert heights[1] - heights[0] == pytest.approx(0.29, abs=0.06)


@pytest.mark.parametrize("speed, manner", [(0.2, "from a stand"), (1.4, "in a walk"), (4.0, "on the run")])
def test_a_kick_suits_the_player(speed, manner):
    assert find_action(ask("kick", "low", speed=speed)).name == f"inside kick {manner}"
    assert find_action(ask("kick", "top", speed=speed)).name == f"instep kick {manner}"


def test_inside_and_instep_are_offered_in_two_directions_unless_one_is_asked_for():
    moment = ask("kick", "low", "running", speed=4.0, height=0.11, exit_speed=21.0)
    assert [path.split("action_")[1] for path in find_action_paths(moment)] == [
        f"{part}_kick_on_the_run_v4.4_z0.1_b18.0_d{way}.bvh" for part in ("inside", "instep") for way in ("-15", "+30")]
    only = find_action_paths(replace(moment, labels=moment.labels | {"inside"}))
    assert len(only) == 2 and all("inside" in path for path in only)
    standing = find_action_paths(ask("kick", "low", "standing"))
    assert len(standing) == 2 and not np.any(["_d" in path for path in standing])
