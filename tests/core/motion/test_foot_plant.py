"""Feet held where they stand: a planted slide is taken out, and nothing else is broken by it."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.time_series import find_runs
from beyond_mocap.motion import contacts
from beyond_mocap.motion.foot_plant import MAX_DROP, MAX_SHIFT, plant_feet, solve_limited_shift, solve_shift
from beyond_mocap.motion.humanoid import identify_joints, measure_leg_length
from beyond_mocap.motion.limb import solve_two_bone
from beyond_mocap.motion.motion import compute_local_rotations, compute_pose, place_motion
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.synthetic.gait import build_gait


@pytest.fixture(scope="module")
def walk():
    """A clean walk along +x, toes on the ground, and which of its heels and toes stand."""
    return grounded(build_gait(1.4, 4.0, 30.0))


def grounded(motion):
    down = motion.root_positions - [0.0, 0.0, contacts.measure_floor_height(motion)]
    return replace(motion, root_positions=down), contacts.detect_heel_toe_contacts(motion)


def feet_of(motion, root, rotations):
    """Heels and toes (T, 2 sides, 2, 3)."""
    body = identify_joints(motion.skeleton)
    places, _ = compute_pose(motion.skeleton, root, rotations)
    return np.stack([places[:, [limb.foot, limb.toe_or_foot]] for limb in (body.left, body.right)], axis=1)


def slide(motion, root, rotations, stands):
    """Mean speed over ground in m/s of toes where both points of a foot stand, now and in the next frame."""
    toes = feet_of(motion, root, rotations)[:, :, 1, :2]
    speed = np.linalg.norm(np.diff(toes, axis=0), axis=-1) * motion.fps
    flat = stands.all(axis=2)
    return speed[flat[1:] & flat[:-1]].mean()


def planted(motion, stands, moved=0.0):
    """The motion with `moved` (T, 3) added to its root, before and after planting."""
    root = motion.root_positions + moved
    return root, plant_feet(motion.skeleton, root, motion.rotations, stands, motion.fps)


@pytest.mark.parametrize("velocity", [(0.3, 0.0), (0.0, 0.2), (-0.3, 0.1)])
def test_a_planted_slide_is_removed(walk, velocity):
    motion, stands = walk
    moved = np.outer(np.arange(len(motion)) / 30.0, (*velocity, 0.0))
    root, out = planted(motion, stands, moved)
    before, own = (
        slide(motion, root, motion.rotations, stands),
        slide(motion, motion.root_positions, motion.rotations, stands),
    )
    after = slide(motion, out.root, out.rotations, stands)
    assert before > 0.8 * np.hypot(*velocity) and own < 0.03
    assert after < 0.016
    assert np.array_equal(out.root[:, :2], root[:, :2])


def test_turning_on_a_standing_foot_is_removed(walk):
    motion, stands = walk
    turned = place_motion(motion, 0.05 * np.sin(np.arange(len(motion)) / 10.0))
    out = plant_feet(motion.skeleton, turned.root_positions, turned.rotations, stands, 30.0)
    before = slide(motion, turned.root_positions, turned.rotations, stands)
    assert slide(motion, out.root, out.rotations, stands) < 0.25 * before


def test_a_clean_walk_stays_as_it_is(walk):
    motion, stands = walk
    root, out = planted(motion, stands)
    change = feet_of(motion, out.root, out.rotations) - feet_of(motion, root, motion.rotations)
    assert np.median(np.linalg.norm(change, axis=-1)) < 0.01 and np.abs(change).max() < 0.05
    assert np.abs(out.root - root).max() < 0.04


@pytest.mark.parametrize("height", [0.0, -0.03, -0.06])
def test_feet_that_sank_stand_on_the_ground(walk, height):
    motion, stands = walk
    _, out = planted(motion, stands, np.array([0.0, 0.0, height]))
    toes = feet_of(motion, out.root, out.rotations)[:, :, 1, 2]
    assert toes.min() > -0.012 and np.percentile(toes, 2) > -0.006
    assert np.median(np.abs(toes[stands.all(axis=2)])) < 0.006


def test_a_heel_rises_before_the_pelvis_sinks(walk):
    """A body that floats 4 cm too high: it stands on its toes, and hardly sinks."""
    motion, stands = walk
    _, still = planted(motion, stands)
    root, out = planted(motion, stands, np.array([0.0, 0.0, 0.04]))
    (low, up), behind = ((feet_of(motion, p.root, p.rotations)[..., 2] for p in (still, out)), stands[..., 1])
    assert np.median(np.abs(up[..., 1][behind])) < 0.006 and out.miss.max() < 0.005
    assert np.percentile((up[..., 0] - low[..., 0])[behind], 90) > 0.02
    assert (root[:, 2] - out.root[:, 2]).max() <= MAX_DROP + 1e-9


def test_a_stance_holds_though_its_end_is_out_of_reach(walk):
    """As where two clips join in the middle of a stance: the body goes ahead by 0.28 m, and the foot leaves earlier."""
    motion, stands = walk
    first, end = find_runs(stands[:, 1].any(axis=1))[2]
    through = np.clip((np.arange(len(motion)) - 0.5 * (first + end)) / 8.0 + 0.5, 0.0, 1.0)
    root, out = planted(motion, stands, np.outer(0.28 * through**2 * (3.0 - 2.0 * through), (1.0, 0.0, 0.0)))
    toe = feet_of(motion, out.root, out.rotations)[first:end, 1, 1, 0]
    assert np.ptp(toe[1:-3]) < 0.005 < np.ptp(toe)
    assert out.miss[first:end, 1].max() < 0.005


def test_a_foot_in_the_air_need_not_be_reached(walk):
    """Strides twice as long as the legs: no leg is missed while its foot is in the air."""
    motion, stands = walk
    _, out = planted(motion, stands, np.outer(np.arange(len(motion)) / 30.0, (2.5, 0.0, 0.0)))
    assert out.miss[~stands.any(axis=2)].max() < 0.005


def test_bones_keep_their_length_and_rotations_are_unit(walk):
    motion, stands = walk
    _, out = planted(motion, stands, np.outer(np.arange(len(motion)) / 30.0, (0.4, 0.0, 0.0)))
    assert np.allclose(np.linalg.norm(out.rotations, axis=-1), 1.0, atol=1e-9)
    places, _ = compute_pose(motion.skeleton, out.root, out.rotations)
    for joint, parent in enumerate(motion.skeleton.parents):
        if parent >= 0:
            length = np.linalg.norm(places[:, joint] - places[:, parent], axis=1)
            assert np.allclose(length, np.linalg.norm(motion.skeleton.offsets[joint]), atol=1e-9)


def test_only_legs_and_the_hips_height_move(walk):
    motion, stands = walk
    root, out = planted(motion, stands, np.outer(np.arange(len(motion)) / 30.0, (0.4, 0.0, 0.0)))
    body = identify_joints(motion.skeleton)
    legs = {j for limb in (body.left, body.right) for j in (limb.upper_leg, limb.lower_leg, limb.foot)}
    others = [j for j in range(len(motion.skeleton)) if j not in legs]
    assert np.array_equal(out.rotations[:, others], motion.rotations[:, others])
    drop = root[:, 2] - out.root[:, 2]
    assert drop.min() > -1e-9 and drop.max() <= MAX_DROP + 1e-9


def test_what_was_moved_is_told(walk):
    motion, stands = walk
    root, out = planted(motion, stands, np.outer(np.arange(len(motion)) / 30.0, (0.2, 0.0, 0.0)))
    change = feet_of(motion, out.root, out.rotations)[:, :, 0] - feet_of(motion, root, motion.rotations)[:, :, 0]
    reached = out.miss < 1e-4
    assert reached.mean() > 0.8
    assert np.allclose(np.linalg.norm(change, axis=-1)[reached], out.correction[reached], atol=2e-3)
    assert np.all(out.miss >= 0.0) and np.all(out.correction >= 0.0)


@pytest.mark.parametrize("stands", [False, True])
@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 40])
def test_never_or_always_standing_and_few_frames(walk, stands, count):
    motion = walk[0].frames(0, count)
    out = plant_feet(motion.skeleton, motion.root_positions, motion.rotations, np.full((count, 2, 2), stands), 30.0)
    for values in (out.root, out.rotations, out.correction, out.miss):
        assert np.all(np.isfinite(values))
    assert out.rotations.shape == motion.rotations.shape and out.correction.shape == (count, 2)


def test_a_foot_that_never_stands_is_left_where_it_is(walk):
    motion, _ = walk
    high = np.array([0.0, 0.0, 0.5])
    root, out = planted(motion, np.zeros((len(motion), 2, 2), bool), high)
    change = feet_of(motion, out.root, out.rotations) - feet_of(motion, root, motion.rotations)
    assert np.abs(change).max() < 0.01


@pytest.mark.parametrize("fps", [24.0, 60.0, 120.0])
def test_at_any_rate(fps):
    motion, stands = grounded(build_gait(1.4, 4.0, fps))
    moved = np.outer(np.arange(len(motion)) / fps, (0.3, 0.0, 0.0))
    root, out = planted(motion, stands, moved)
    assert (
        slide(motion, out.root, out.rotations, stands) < 0.02 and slide(motion, root, motion.rotations, stands) > 0.25
    )


def test_the_input_is_left_alone(walk):
    motion, stands = walk
    root, rotations = motion.root_positions.copy(), motion.rotations.copy()
    plant_feet(motion.skeleton, root, rotations, stands, 30.0)
    assert np.array_equal(root, motion.root_positions) and np.array_equal(rotations, motion.rotations)


def test_the_shift_cancels_velocity_where_it_has_weight_and_is_gentle_elsewhere():
    velocity = np.full((89, 1), 0.01)
    weight = np.zeros((90, 1))
    weight[20:40] = weight[60:80] = 1.0
    found = solve_shift(velocity, weight)[:, 0]
    assert np.allclose(np.diff(found)[22:37], -0.01, atol=1e-3) and np.allclose(np.diff(found)[62:77], -0.01, atol=1e-3)
    assert np.abs(np.diff(found, 3)).max() < 0.02 and np.abs(found).max() < 0.25
    assert np.allclose(solve_shift(velocity, weight * 0.0), 0.0)


def test_a_stance_that_drags_too_far_slides_at_its_ends_alone():
    velocity, weight = np.zeros((89, 2, 2)), np.zeros((90, 2))
    velocity[30:60, :, 0], weight[30:61] = 0.035, [0.2, 1.0]  # a metre within a second
    shift, _ = solve_limited_shift(velocity, weight, scale=1.0)
    slide = np.abs(np.diff(shift, axis=0) + velocity[:, 1])[:, 0]
    assert slide[38:52].max() < 2e-3 and np.abs(shift[30:61]).max() < 1.1 * MAX_SHIFT


def test_a_given_shift_is_reached_and_kept_while_the_foot_stands():
    weight = np.zeros((60, 1))
    weight[20:40] = 1.0
    kept = np.full((60, 2), np.nan)
    kept[:25] = [0.03, -0.01]
    found = solve_shift(np.zeros((59, 2)), weight, fixed_shifts=kept)
    assert np.allclose(found[:25], [0.03, -0.01], atol=1e-6)
    assert np.abs(np.diff(found[25:40], axis=0)).max() < 5e-4 and np.abs(found[55:]).max() < 2e-3


def knees_of(motion, root, rotations):
    """Angle inside both knees (T, 2), degrees."""
    body = identify_joints(motion.skeleton)
    places, _ = compute_pose(motion.skeleton, root, rotations)
    out = []
    for limb in (body.left, body.right):
        up, down = (places[:, other] - places[:, limb.lower_leg] for other in (limb.upper_leg, limb.foot))
        cosine = np.sum(up * down, axis=1) / (np.linalg.norm(up, axis=1) * np.linalg.norm(down, axis=1))
        out.append(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    return np.stack(out, axis=1)


@pytest.mark.parametrize("levels", [True, False])
def test_a_leg_comes_as_straight_as_it_was(walk, levels):
    """Whoever stands and goes up to straight knees, at 172 degrees, keeps them; nothing slides."""
    motion, _ = walk
    body = identify_joints(motion.skeleton)
    count, leg = 60, measure_leg_length(motion.skeleton)
    stance = build_neutral_stance(motion.skeleton)
    rotations = np.tile(compute_local_rotations(motion.skeleton, stance.rotations), (count, 1, 1))
    straight = compute_pose(motion.skeleton, np.zeros((1, 3)), rotations[:1])[0][0]
    rise = -0.0025 * leg - 0.02 * (1.0 + np.cos(np.linspace(0.0, 2.0 * np.pi, count)))
    root = np.outer(rise - straight[body.left.toe_or_foot, 2], [0.0, 0.0, 1.0])
    for limb in (body.left, body.right):
        target = np.tile(straight[limb.foot] - [0.0, 0.0, straight[body.left.toe_or_foot, 2]], (count, 1))
        chain = (limb.upper_leg, limb.lower_leg, limb.foot)
        rotations = solve_two_bone(motion.skeleton, root, rotations, chain, target, soft=1e-6).rotations
    given = knees_of(motion, root, rotations)
    assert given.max() > 170.0
    out = plant_feet(motion.skeleton, root, rotations, np.ones((count, 2, 2), bool), 30.0, level_feet=levels)
    assert np.abs(knees_of(motion, out.root, out.rotations) - given).max() < 2.0
