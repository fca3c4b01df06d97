"""Takes of players who breathe after sprints: when, by how much, in edits, and not where the ball is met."""

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.construct import construction
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resynthesize import resynthesize
from beyond_mocap.synthesis.synthesize import synthesize

REST = slice(270, 450)  # frames after the sprint has ended
EDIT = 11.0  # s


@pytest.fixture(scope="module")
def track():
    """Fifteen seconds: a walk, a sprint from second 3 to 7, then a walk with a kick in second 13."""
    times = np.arange(0.0, 15.01, 0.04)
    speed = np.interp(times, [0.0, 2.0, 4.0, 6.0, 8.0, 15.0], [1.4, 1.4, 7.5, 7.5, 1.3, 1.3])
    ahead = np.concatenate([[0.0], np.cumsum(speed[1:] * 0.04)])
    return Track(times, np.column_stack([ahead, 0.0 * times]), np.full((len(times), 3), np.nan))


@pytest.fixture(scope="module")
def takes(library, track):
    """Takes by fatigue."""
    return {fatigue: synthesize(library, Plan(track=track, fatigue=fatigue)) for fatigue in (0.0, 0.5, 1.0)}


def measure_turn(library, before, after, joint="chest"):
    """(T,) degrees by which two takes turn a joint of the body otherwise."""
    at = getattr(identify_joints(library.skeleton), joint)
    worlds = [forward_kinematics(take.motion)[1][:, at] for take in (before, after)]
    turn = quaternion.to_rotation_vector(quaternion.multiply(worlds[1], quaternion.inverse(worlds[0])))
    return np.degrees(np.linalg.norm(turn, axis=1))


def test_the_trunk_slumps_and_breathes_after_the_sprint_by_the_setting(library, takes):
    half, whole = (measure_turn(library, takes[0.0], takes[fatigue]) for fatigue in (0.5, 1.0))
    assert whole[:90].max() < 0.01 and whole[120:180].max() < 0.01
    assert 1.0 < whole[REST].mean() < 6.0 and np.ptp(whole[REST]) > 1.0
    assert half[REST].mean() == pytest.approx(0.5 * whole[REST].mean(), rel=0.05)


def test_legs_and_root_stay_after_the_sprint(library, takes):
    """In it momentum may move them, since the centre of mass behind it is another."""
    before, after = takes[0.0], takes[1.0]
    body = identify_joints(library.skeleton)
    places = [forward_kinematics(take.motion)[0] for take in (before, after)]
    apart = np.linalg.norm(places[0] - places[1], axis=2)
    assert apart[REST][:, [body.hips, body.left.foot, body.right.foot]].max() < 0.001
    assert np.array_equal(before.contacts, after.contacts)


def test_fatigue_0_does_nothing(library, track, takes, monkeypatch):
    monkeypatch.setattr(construction, "breathe", None)
    again = synthesize(library, Plan(track=track))
    assert np.array_equal(again.motion.rotations, takes[0.0].motion.rotations)


def test_no_breath_where_the_ball_is_met(library, track, timeline_of):
    takes = [synthesize(library, Plan(track=track, timeline=timeline_of((13.0, "kick right")), fatigue=fatigue))
             for fatigue in (0.0, 1.0)]
    turned, met = measure_turn(library, *takes), int(round(takes[0].keys[0].frame))
    assert turned[met - 6 : met + 7].max() < 0.05 and turned[REST].max() > 2.0


def test_an_exhausted_player_breathes_from_the_first_frame_on(library, track, takes):
    tired = synthesize(library, Plan(track=track, fatigue=1.0, exertion=20.0))
    assert measure_turn(library, takes[0.0], tired)[:45].mean() > 1.5


def test_an_edit_breathes_on(library, track, takes):
    """Frames beside the edit keep their bits, and the breath goes through its borders as through all frames."""
    bump = np.exp(-((track.times - EDIT) ** 2) / 0.3)[:, None] * [0.0, -0.6]
    moved = Track(track.times, track.positions + bump, track.ball)
    calm, tired = (resynthesize(library, Plan(track=moved, fatigue=fatigue), takes[fatigue]) for fatigue in (0.0, 1.0))
    is_new = np.any(tired.motion.root_positions != takes[1.0].motion.root_positions, axis=1)
    assert is_new[315:345].all() and not is_new[:225].any()
    turned = measure_turn(library, calm, tired)
    assert turned[is_new].mean() > 1.0
    assert np.abs(np.diff(turned)).max() < 0.3
