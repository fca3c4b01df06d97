"""A constructed body obeys momentum: its flights are free falls, feet stand where they stood, and walks stay."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.mass import compute_centre_of_mass
from beyond_mocap.motion.momentum_polish import keep_above_ground, obey_momentum
from beyond_mocap.motion.motion import compute_pose
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.motion.supports import GRAVITY, find_stances, find_support_phases
from beyond_mocap.synthetic.gait import build_gait


def polish(motion, share=1.0):
    share = np.broadcast_to(share, len(motion))
    return obey_momentum(motion.skeleton, motion.root_positions, motion.rotations, motion.fps, share)


def measure_flights(motion, root, rotations):
    """Second differences (F, 3) m/s^2 of the centre of mass in the frames in which `motion` flies, ends left out."""
    body, (before, _) = identify_joints(motion.skeleton), compute_pose(motion.skeleton, motion.root_positions,
                                                                     motion.rotations)
    stances = find_stances(motion.skeleton, before, motion.fps)
    phases = find_support_phases(stances, compute_centre_of_mass(body, before), motion.fps)
    at = np.arange(1, len(motion) - 1)
    free = np.all([(at <= start - 1.0) | (at >= stop + 1.0) for start, stop in phases], axis=0)
    centre = compute_centre_of_mass(body, compute_pose(motion.skeleton, root, rotations)[0])
    return np.diff(centre, 2, axis=0)[free] * motion.fps**2


@pytest.fixture(scope="module")
def run():
    """A run whose pelvis sways as no body is pushed in the air."""
    motion = build_gait(6.5, 4.0, 30.0)
    sway = 0.015 * np.sin(20.0 * np.arange(len(motion)) / 30.0)[:, None] * [1.0, 1.0, 0.0]
    return replace(motion, root_positions=motion.root_positions + sway)


@pytest.fixture(scope="module")
def polished(run):
    return polish(run)


@pytest.fixture(scope="module")
def braking():
    """From a sprint to standing."""
    return build_gait(np.concatenate([np.full(45, 6.0), np.linspace(6.0, 0.0, 45), np.zeros(60)]), fps=30.0)


@pytest.mark.parametrize("speed", [0.0, 1.4])
def test_who_never_leaves_the_ground_stays_bit_for_bit(speed):
    motion = build_gait(speed, 2.0, 30.0)
    root, rotations = polish(motion)
    assert np.array_equal(root, motion.root_positions) and np.array_equal(rotations, motion.rotations)


def test_flights_of_a_run_are_free_falls(run, polished):
    before, after = (measure_flights(run, *pose) for pose in ((run.root_positions, run.rotations), polished))
    assert len(after) > 20 and np.linalg.norm(before + [0.0, 0.0, GRAVITY], axis=1).max() > 3.0
    assert np.median(after[:, 2]) == pytest.approx(-GRAVITY, abs=0.3)
    assert np.median(np.linalg.norm(after[:, :2], axis=1)) < 0.3 and np.abs(after + [0.0, 0.0, GRAVITY]).max() < 1.5


@pytest.mark.parametrize("fps", [25.0, 60.0])
def test_flights_are_free_falls_at_other_rates(fps):
    motion = build_gait(5.0, 2.0, fps)
    assert np.median(measure_flights(motion, *polish(motion))[:, 2]) == pytest.approx(-GRAVITY, abs=0.3)


def test_the_body_moves_little(run, polished):
    assert np.abs(polished[0] - run.root_positions).max() < 0.08
    assert np.abs((polished[0] - run.root_positions)[:, :2].mean(axis=0)).max() < 0.01


def test_feet_in_a_stance_keep_their_place(run, polished):
    body = identify_joints(run.skeleton)
    before, after = (compute_pose(run.skeleton, *pose)[0] for pose in ((run.root_positions, run.rotations), polished))
    stances, seen = find_stances(run.skeleton, before, run.fps), 0
    for side, start, stop in zip(stances.side, stances.start, stances.stop):
        frames, limb = slice(int(np.ceil(start)), int(stop) + 1), (body.left, body.right)[side]
        moved = (after - before)[frames, limb.toe_or_foot]  # a whole stance may lean, as one
        assert np.linalg.norm(moved - moved.mean(axis=0), axis=1).max() < 0.003 and np.abs(moved[:, 2]).max() < 0.003
        seen += len(moved)
    assert seen > 40


def test_rotations_are_rotations_and_change_sign_nowhere(polished):
    assert np.linalg.norm(polished[1], axis=-1) == pytest.approx(1.0, abs=1e-9)
    assert np.sum(polished[1][1:] * polished[1][:-1], axis=-1).min() > 0.5


def test_bones_keep_their_lengths(run, polished):
    places, _ = compute_pose(run.skeleton, *polished)
    parents = np.array(run.skeleton.parents)
    lengths = np.linalg.norm(places[:, 1:] - places[:, parents[1:]], axis=-1)
    assert lengths == pytest.approx(np.tile(np.linalg.norm(run.skeleton.offsets[1:], axis=1), (len(places), 1)))


def test_the_same_input_gives_the_same_bits_and_stays_as_it_was(run, polished):
    root, rotations = run.root_positions.copy(), run.rotations.copy()
    assert all(np.array_equal(*pair) for pair in zip(polish(run), polished))
    assert np.array_equal(root, run.root_positions) and np.array_equal(rotations, run.rotations)


@pytest.mark.parametrize("first", [0, 40])
def test_frames_without_a_share_stay_bit_for_bit_and_join_without_a_jump(run, braking, first):
    for motion in (run, braking):
        away = np.clip((np.abs(np.arange(len(motion)) - first - 12) - 12) / 9.0, 0.0, 1.0)
        share = away**2 * (3.0 - 2.0 * away)
        root, rotations = polish(motion, share)
        stays = share == 0.0
        assert stays.sum() > 20 and np.array_equal(root[stays], motion.root_positions[stays])
        assert np.array_equal(rotations[stays], motion.rotations[stays])
        before, after = compute_pose(motion.skeleton, motion.root_positions, motion.rotations)[0], compute_pose(
            motion.skeleton, root, rotations)[0]
        beside = np.flatnonzero(np.diff(stays.astype(int)))
        moved = np.linalg.norm(after - before, axis=-1).max(axis=1)
        assert moved.max() > 0.02 and np.maximum(moved[beside], moved[beside + 1]).max() < 0.025


def test_a_body_that_stopped_stands_as_it_stood(braking):
    root, rotations = polish(braking)
    assert root[-45:] == pytest.approx(braking.root_positions[-45:], abs=0.005)
    assert np.abs(rotations[-45:, 0] - braking.rotations[-45:, 0]).max() < 1e-3


@pytest.mark.parametrize("count", [1, 2, 3, 4, 6, 9])
def test_the_shortest_stretches_of_a_run_are_no_error(run, count):
    for first in range(10):
        piece = run.frames(first, first + count)
        root, rotations = polish(piece)
        assert np.isfinite(rotations).all() and np.abs(root - piece.root_positions).max() < 0.1


def test_a_body_in_the_air_all_the_time_stays(run):
    root = run.root_positions + [0.0, 0.0, 1.0] * np.arange(len(run))[:, None]
    moved, _ = obey_momentum(run.skeleton, root, run.rotations, run.fps, np.ones(len(run)))
    assert np.isfinite(moved).all()


@pytest.mark.parametrize("height", [0.0, 0.02, 0.3])
def test_a_foot_that_sinks_with_the_pelvis_stays_above_the_ground(height):
    move = np.linspace(0.1, -0.5, 200)
    limited = keep_above_ground(move, np.full(200, height))
    assert (limited + height >= -1e-6).all() and (np.diff(limited) <= 0.0).all()
    free = move >= -0.5 * height
    assert np.array_equal(limited[free], move[free]) and free.sum() > 30


def test_a_skeleton_without_toes_obeys_momentum():
    whole = build_adult_skeleton()
    body = identify_joints(whole)
    keep = [joint for joint in range(len(whole)) if joint not in (body.left.toe, body.right.toe)]
    parents = [keep.index(whole.parents[joint]) if joint else -1 for joint in keep]
    motion = build_gait(6.0, 2.0, 30.0, Skeleton([whole.names[j] for j in keep], parents, whole.offsets[keep]))
    assert identify_joints(motion.skeleton).left.toe is None
    after = measure_flights(motion, *polish(motion))
    assert len(after) > 5 and np.median(after[:, 2]) == pytest.approx(-GRAVITY, abs=0.5)


def test_a_skeleton_without_legs_is_an_input_error():
    stick = Skeleton(("a", "b"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    with pytest.raises(InputError):
        obey_momentum(stick, np.zeros((4, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (4, 2, 1)), 30.0, np.ones(4))
