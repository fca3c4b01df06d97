"""Cycling: an exactly periodic gait is found with its period and goes on as if it had never ended; what has no stride
is told."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion import contacts, quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import compute_pose
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.path_editing import cycle
from beyond_mocap.path_editing.cycle import KEPT_SCALE, MOST_SCALE, SAME_LENGTH, cycle_motion
from beyond_mocap.path_editing.loops import find_loops, measure_stride
from beyond_mocap.path_editing.path_edit_settings import PathEditSettings
from beyond_mocap.path_editing.path_edit_source import prepare_source
from beyond_mocap.path_editing.path_frame import Residuals
from beyond_mocap.synthetic.gait import build_gait

PERIOD, FPS = 36, 30.0


def planted(count, period=PERIOD, offset=0, drift=0.0):
    """`count` frames of a gait that repeats every `period` frames exactly, from frame `offset` on; drift: metres a
    frame by which the body leaves its path."""
    skeleton = build_adult_skeleton()
    body = identify_joints(skeleton)
    frames = np.arange(offset, offset + count)
    phase = 2.0 * np.pi * frames / period
    rotations = quaternion.identity(count, len(skeleton))
    for limb, side in ((body.left, 0.0), (body.right, np.pi)):
        for joint, swing in ((limb.upper_leg, 0.5), (limb.lower_leg, 0.3), (limb.upper_arm, -0.4)):
            angle = swing * np.sin(phase + side) + 0.1 * np.cos(2.0 * phase)
            rotations[:, joint] = quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), angle)
    sway = np.stack([0.02 * np.sin(2 * phase), 0.03 * np.sin(phase), 0.9 + 0.02 * np.cos(2 * phase)], axis=1)
    step = 0.04 + 0.006 * np.sin(2.0 * phase)
    step[0] = 0.0
    left = np.sin(phase + 0.3) > -0.2
    standing = np.repeat(np.stack([left, np.sin(phase + np.pi + 0.3) > -0.2], axis=1)[..., None], 2, axis=2)
    return Residuals(
        place=sway + drift * np.arange(count)[:, None] * [0.0, 1.0, 0.0], rotations=rotations, step=step,
        standing=standing, frames=frames.astype(float), turn=0.01 * np.cos(phase), under=np.zeros((count, 2)),
        up=np.tile([0.0, 0.0, 1.0], (count, 2, 1)), fps=FPS, skeleton=skeleton,
    )  # fmt: skip


def still(count=60):
    return replace(planted(count), step=np.zeros(count), standing=np.ones((count, 2, 2), bool))


@pytest.fixture(scope="module")
def walk():
    """What a made walk of four seconds is relative to its path."""
    return prepare_source(build_gait(1.4, 4.0, 60.0, seed=3), PathEditSettings()).residuals


@pytest.fixture(scope="module")
def stop():
    """A made walk that stops after three and a half seconds."""
    seconds = np.arange(300) / 60.0
    return prepare_source(build_gait(1.4 * np.clip((4.2 - seconds) / 0.7, 0.0, 1.0), fps=60.0, seed=3),
                          PathEditSettings()).residuals


@pytest.mark.parametrize("period", [24, 36, 41])
def test_the_planted_period_is_found_and_costs_nothing(period):
    residuals = planted(int(3.6 * period), period)
    assert measure_stride(residuals) == pytest.approx(period, abs=1.0)
    found = find_loops(residuals)
    assert found and all(len(loop) % period == 0 for loop in found[:2])
    assert found[0].distance < 1e-6


@pytest.mark.parametrize("times", [1.3, 2.0, 4.7])
def test_a_periodic_gait_goes_on_as_if_it_had_never_ended(times):
    residuals = planted(130)
    out = cycle_motion(residuals, times * residuals.step.sum())
    truth = planted(len(out.residuals))
    scale = out.scale
    assert len(out.transitions) >= 1 and abs(scale - 1.0) <= MOST_SCALE
    assert np.allclose(out.residuals.place, truth.place, atol=1e-9)
    assert np.allclose(out.residuals.step, scale * truth.step, atol=1e-9)
    assert np.allclose(np.abs(np.sum(out.residuals.rotations * truth.rotations, axis=-1)), 1.0, atol=1e-12)
    assert np.array_equal(out.residuals.standing, truth.standing)
    assert np.allclose(out.residuals.turn, truth.turn, atol=1e-9)


def test_the_same_input_gives_the_same_bits(walk):
    first, second = (cycle_motion(walk, 17.0) for _ in range(2))
    for name, values in first.residuals.arrays.items():
        assert np.array_equal(values, getattr(second.residuals, name)), name
    assert np.array_equal(first.transitions, second.transitions)


def test_the_recorded_end_comes_where_the_path_ends(stop):
    own = stop.step.sum()
    for length in own * np.array([2.0, 2.5, 3.1, 4.0, 5.3]):
        out = cycle_motion(stop, length)
        shown = out.residuals
        assert shown.step.sum() == pytest.approx(length, abs=1e-6)
        assert np.array_equal(shown.frames[-20:], stop.frames[-20:]) and np.array_equal(
            shown.frames[:20], stop.frames[:20]
        )
        assert abs(out.scale - 1.0) <= MOST_SCALE + 1e-6


def test_who_ends_as_he_goes_keeps_his_speed(walk):
    for length in walk.step.sum() * np.linspace(1.2, 4.0, 8):
        out = cycle_motion(walk, length)
        assert abs(out.scale - 1.0) <= KEPT_SCALE + 1e-6 and not out.messages
        assert out.residuals.step.sum() == pytest.approx(length, abs=SAME_LENGTH)


def test_where_the_end_cannot_be_met_the_motion_is_cut_while_it_goes_on(stop):
    loop = find_loops(stop)[0]
    length = stop.step.sum() + 0.5 * loop.metres
    out = cycle_motion(stop, length, (loop,))
    assert out.residuals.step.sum() == pytest.approx(length, abs=SAME_LENGTH) and abs(out.scale - 1.0) < 0.002
    assert "cut there" in out.messages[0]
    assert out.residuals.frames[-1] < loop.end  # not in the middle of stopping


def test_a_motion_of_the_path_s_length_gets_no_lap_more(walk, stop):
    own = float(walk.step.sum())
    for length in (own, own - 9e-4, own + 9e-4, 0.5 * own):
        out = cycle_motion(walk, length)
        assert out.residuals is walk and not len(out.transitions)
    for share in (0.97, 1.03):
        almost = cycle_motion(stop, share * stop.step.sum())
        assert len(almost.residuals) == len(stop) and almost.scale == pytest.approx(share)


def test_a_seam_neither_jumps_nor_lets_a_moved_foot_stand(walk):
    out = cycle_motion(walk, 3.0 * walk.step.sum())
    shown = out.residuals
    root = shown.place + np.cumsum(shown.step)[:, None] * [1.0, 0.0, 0.0]
    speed = np.linalg.norm(np.diff(root, axis=0), axis=1) * shown.fps
    own = np.linalg.norm(np.diff(walk.place + np.cumsum(walk.step)[:, None] * [1.0, 0, 0], axis=0), axis=1) * walk.fps
    assert own.min() - 0.1 < speed[1:].min() and speed.max() < own.max() + 0.1
    places, _ = compute_pose(shown.skeleton, root, shown.rotations)
    body = identify_joints(shown.skeleton)
    for side, limb in enumerate((body.left, body.right)):
        move = np.linalg.norm(np.diff(places[:, limb.toe_or_foot, :2], axis=0), axis=1) * shown.fps
        held = shown.standing[1:, side, 1] & shown.standing[:-1, side, 1]
        assert np.percentile(move[held], 99) < 0.45  # a swinging foot does 3 m/s


def test_a_recording_that_ends_at_the_loop_is_carried_on():
    residuals = planted(PERIOD + 1, drift=1e-3)
    out = cycle_motion(residuals, 3.0 * residuals.step.sum())
    assert len(out.transitions) and np.isfinite(out.residuals.place).all()
    jump = np.abs(np.diff(out.residuals.place[:, 1]))
    assert jump.max() < 0.012  # the sway's own 5 mm a frame, and 36 mm of drift faded over 12 frames


@pytest.mark.parametrize("make, says", [
    (still, "stays in place"),
    (lambda: planted(20), "can be repeated"),
    (lambda: prepare_source(build_gait(5.0, 1.0, 60.0).frames(0, 4), PathEditSettings()).residuals, "can be repeated"),
    (lambda: prepare_source(build_gait(0.0, 3.0, 30.0), PathEditSettings()).residuals, "stays in place"),
])
def test_what_has_no_stride_is_told(make, says):
    with pytest.raises(InputError, match=says) as told:
        cycle_motion(make(), 30.0)
    assert "cycling off" in str(told.value)


def test_a_jump_with_both_feet_is_no_stride():
    up = planted(100)
    both = np.repeat(np.sin(2 * np.pi * np.arange(100) / PERIOD) > -0.2, 4).reshape(100, 2, 2)
    assert not find_loops(replace(up, standing=both))


@pytest.mark.parametrize("length", [0.0, -1.0, np.nan, np.inf])
def test_a_length_that_is_none_is_told(walk, length):
    with pytest.raises(InputError, match="path"):
        cycle_motion(walk, length)


def test_an_endless_path_is_not_filled_endlessly(walk, monkeypatch):
    monkeypatch.setattr(cycle, "MOST_FRAMES", 3000)
    out = cycle_motion(walk, 1e9)
    assert 2000 < len(out.residuals) < 3500
    assert "1000000000 m is too long: the motion ends after 1 minutes" in out.messages[0]


def test_a_body_without_known_feet_is_repeated_by_its_poses():
    residuals = replace(planted(130), standing=np.zeros((130, 2, 2), bool))
    assert len(find_loops(residuals)[0]) % PERIOD == 0


def test_a_curve_s_turn_is_carried_too():
    motion = build_gait(1.4, 4.0, 60.0, turn_rate=0.4, seed=2)
    residuals = prepare_source(motion, PathEditSettings(), contacts.detect_heel_toe_contacts(motion)).residuals
    out = cycle_motion(residuals, 2.5 * residuals.step.sum()).residuals
    assert np.median(out.turn) == pytest.approx(np.median(residuals.turn), rel=0.2)
