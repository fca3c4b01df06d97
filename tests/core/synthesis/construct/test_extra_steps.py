"""Standing feet that would be dragged step instead; those that would not be stay where they are."""

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.motion.foot_plant import plant_feet
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import compute_pose
from beyond_mocap.motion.track import smooth_zero_phase_hann
from beyond_mocap.synthesis.construct.extra_steps import FOOT_SEPARATION, LIFT_HEIGHT, add_steps
from beyond_mocap.synthetic.gait import build_gait

FPS, COUNT = 30.0, 300
STANDING = np.ones((COUNT, 2, 2), bool)


@pytest.fixture(scope="module")
def still():
    """A standing pose for ten seconds, soles on the ground."""
    motion = build_gait(0.0, 1.0, FPS)
    body = identify_joints(motion.skeleton)
    rotations = np.tile(motion.rotations[:1], (COUNT, 1, 1))
    root = np.tile(motion.root_positions[:1], (COUNT, 1))
    places, _ = compute_pose(motion.skeleton, root, rotations)
    root[:, 2] -= places[0, [body.left.toe, body.right.toe], 2].mean()
    return motion.skeleton, root, rotations


def dragged(still, velocity=(0.0, 0.0), turn=0.0):
    """The pose carried along at `velocity` m/s and turned by `turn` radians a second."""
    skeleton, root, rotations = still
    seconds = np.arange(COUNT) / FPS
    rotations = rotations.copy()
    rotations[:, 0] = quaternion.multiply(quaternion.from_up_angle(turn * seconds), rotations[:, 0])
    return skeleton, root + np.outer(seconds, (*velocity, 0.0)), rotations


def stepped_and_planted(body, standing=STANDING):
    skeleton, root, rotations = body
    taken = add_steps(skeleton, root, rotations, standing, FPS)
    root = root + np.column_stack([taken.sway, np.zeros(len(root))])
    out = plant_feet(skeleton, root, taken.rotations, taken.heel_toe_contacts, FPS, foot_moves=taken.moves)
    legs = identify_joints(skeleton)
    places, _ = compute_pose(skeleton, out.root, out.rotations)
    heels, toes = (places[:, [getattr(limb, name) for limb in (legs.left, legs.right)]] for name in ("foot", "toe"))
    return taken, heels, toes


def runs(flags):
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return edges.reshape(-1, 2).tolist()


def in_turn(taken):
    """(first frame, side) of all steps, the first one first."""
    return sorted((first, side) for side in (0, 1) for first, _ in runs(taken.stepped[:, side]))


def widest_slide(places, stands):
    """Metres that a point (T, 2, 3) goes at most within one stance."""
    return max(
        np.ptp(places[first:end, side, :2], axis=0).max() for side in (0, 1) for first, end in runs(stands[:, side])
    )


@pytest.mark.parametrize("velocity", [(0.25, 0.0), (-0.25, 0.0), (0.0, 0.25), (0.1, -0.2)])
def test_a_dragged_body_steps_after_itself(still, velocity):
    taken, heels, toes = stepped_and_planted(dragged(still, velocity))
    assert widest_slide(toes, taken.contacts) < 0.01 and widest_slide(heels, taken.contacts) < 0.015
    sides = [side for _, side in in_turn(taken)]
    assert all(a != b for a, b in zip(sides[:-1], sides[1:]))
    assert 11 <= len(sides) <= 20  # ten seconds at 1.1 to 2 steps a second
    assert not taken.stepped.all(axis=1).any()
    assert np.array_equal(taken.contacts, ~taken.stepped)
    went = toes[-1, :, :2] - toes[0, :, :2]
    assert np.allclose(went, 10.0 * np.array(velocity), atol=0.3)


def test_steps_are_quicker_the_faster_the_body_creeps(still):
    counts = [len(in_turn(stepped_and_planted(dragged(still, (speed, 0.0)))[0])) for speed in (0.06, 0.12, 0.25, 0.4)]
    assert counts[0] >= 2 and np.all(np.diff(counts) >= 2)


def test_feet_that_step_are_lifted_and_come_down(still):
    taken, heels, toes = stepped_and_planted(dragged(still, (0.25, 0.0)))
    for side in (0, 1):
        for first, end in runs(taken.stepped[:, side]):
            assert 0.03 < toes[first:end, side, 2].max() < LIFT_HEIGHT + 0.02
    assert np.abs(toes[..., 2][taken.contacts]).max() < 0.012 and toes[..., 2].min() > -0.012


@pytest.mark.parametrize("velocity", [(0.0, 0.25), (0.0, -0.25), (0.15, 0.2)])
def test_feet_do_not_cross(still, velocity):
    taken, heels, toes = stepped_and_planted(dragged(still, velocity))
    for points in (heels, toes):
        assert np.min(points[:, 0, 1] - points[:, 1, 1]) > 0.7 * FOOT_SEPARATION


def test_who_stands_stands(still):
    skeleton, root, rotations = still
    sway = 0.03 * np.stack([np.sin(np.arange(COUNT) / 11.0), np.cos(np.arange(COUNT) / 17.0), np.zeros(COUNT)], axis=1)
    taken, heels, toes = stepped_and_planted((skeleton, root + sway, rotations))
    assert not taken.stepped.any() and not taken.moves.any() and not taken.sway.any()
    assert np.array_equal(taken.heel_toe_contacts, STANDING)
    assert widest_slide(toes, taken.contacts) < 0.012


def test_a_slow_turn_on_the_spot_is_stepped(still):
    taken, heels, toes = stepped_and_planted(dragged(still, turn=np.radians(9.0)))
    yaw = np.unwrap(np.arctan2(*np.moveaxis((toes - heels)[..., :2][..., ::-1], -1, 0)), axis=0)
    assert np.allclose(np.degrees(yaw[-1] - yaw[0]), 90.0, atol=15.0)
    for side in (0, 1):
        spans = runs(taken.contacts[:, side])
        assert 4 <= len(spans) - 1 <= 8
        assert max(np.ptp(yaw[first:end, side]) for first, end in spans) < np.radians(3.0)
    sides = [side for _, side in in_turn(taken)]
    assert all(a != b for a, b in zip(sides[:-1], sides[1:]))


def test_no_foot_waits_while_the_other_one_steps_again_and_again(still):
    """The right foot's place moves on by itself, as where one recording fades into another: still the left one has its
    turn."""
    skeleton, root, rotations = dragged(still, (0.3, 0.0))
    legs = identify_joints(skeleton)
    rotations = rotations.copy()
    swing = 0.3 * np.sin(np.arange(COUNT) / 9.0)
    turn = np.stack([np.cos(swing / 2.0), np.zeros(COUNT), np.sin(swing / 2.0), np.zeros(COUNT)], axis=1)
    rotations[:, legs.right.upper_leg] = quaternion.multiply(turn, rotations[:, legs.right.upper_leg])
    taken = add_steps(skeleton, root, rotations, STANDING, FPS)
    sides = [side for _, side in in_turn(taken)]
    assert len(sides) > 12 and all(not a == b == c for a, b, c in zip(sides[:-2], sides[1:-1], sides[2:]))


def test_a_walk_stays_as_it_is():
    from beyond_mocap.motion import contacts

    for speed in (0.9, 1.4, 3.5):
        motion = build_gait(speed, 6.0, FPS)
        stands = contacts.detect_heel_toe_contacts(motion)
        taken = add_steps(motion.skeleton, motion.root_positions, motion.rotations, stands, FPS)
        assert not taken.stepped.any() and np.array_equal(taken.heel_toe_contacts, stands)
        assert taken.rotations is motion.rotations


def test_a_gentle_lift_in_the_way_is_left_out(still):
    """The right foot is off the ground for most of the time, 5 cm up, while the left one would be dragged by 30 cm a
    second."""
    skeleton, root, rotations = dragged(still, (0.3, 0.0))
    standing, up = STANDING.copy(), np.zeros((COUNT, 2, 4))
    for first in range(20, COUNT - 40, 60):
        standing[first : first + 40, 1] = False
        up[first : first + 40, 1, 2] = 0.05 * np.sin(np.linspace(0.0, np.pi, 40)) ** 2
    lifted = plant_feet(skeleton, root, rotations, standing, FPS, foot_moves=up)
    taken, heels, toes = stepped_and_planted((skeleton, lifted.root, lifted.rotations), standing)
    assert widest_slide(toes, taken.contacts) < 0.015
    assert taken.heel_toe_contacts[:, 1].any(axis=1).sum() > standing[:, 1].any(axis=1).sum()
    assert not (taken.contacts & ~standing.all(axis=2)).any(), "what does not stand in the source is no contact"


def test_given_steps_are_kept_and_none_added_where_it_is_not_free(still):
    skeleton, root, rotations = dragged(still, (0.25, 0.0))
    given, free = np.zeros((COUNT, 2), bool), np.arange(COUNT) >= 150
    given[60:70, 1] = True
    taken = add_steps(skeleton, root, rotations, STANDING, FPS, given, free)
    assert np.array_equal(taken.stepped[:150], given[:150])
    assert taken.stepped[150:].any()


def test_the_sway_leaves_the_body_on_its_track(still):
    taken, _, _ = stepped_and_planted(dragged(still, (0.25, 0.0)))
    assert np.linalg.norm(taken.sway, axis=1).max() < 0.02
    assert np.linalg.norm(smooth_zero_phase_hann(taken.sway, FPS, 1.5), axis=1).mean() < 0.005


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_short_motions(still, count):
    skeleton, root, rotations = still
    taken = add_steps(skeleton, root[:count], rotations[:count], STANDING[:count], FPS)
    assert taken.moves.shape == (count, 2, 4) and not taken.stepped.any()


def test_the_same_gives_the_same_bits(still):
    first, second = (add_steps(*dragged(still, (0.2, 0.1), 0.1), STANDING, FPS) for _ in range(2))
    for name in ("rotations", "heel_toe_contacts", "contacts", "stepped", "moves", "sway"):
        assert np.array_equal(getattr(first, name), getattr(second, name))
