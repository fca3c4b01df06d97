"""Bodies on one pitch: capsules, tracks spaced apart, corrections as curves, heads that follow one ball."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.match.crowd.capsules import find_capsule_contacts, find_nearest_points
from beyond_mocap.match.crowd.collision_avoidance import measure_overlap_depths
from beyond_mocap.match.crowd.correction import (
    ARMS,
    CURVES,
    FEET,
    ROOT,
    Correction,
    apply_correction,
    apply_curves,
    join_corrections,
)
from beyond_mocap.match.crowd.spacing import (
    DISTANCE,
    TOUCH_FIRMNESS,
    compute_firmness,
    compute_spacing,
    find_episodes,
    find_meetings,
    join_spans,
)
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics, place_motion
from beyond_mocap.synthesis.quality.movement import compute_jerk
from beyond_mocap.synthetic.gait import build_gait

FPS = 30.0


@pytest.fixture(scope="module")
def walk():
    return build_gait(1.4, 4.0, FPS)


def line(a, b):
    return np.array([[a, b]], float)


@pytest.mark.parametrize("one, other, away, shares", [
    (((0, 0, 0), (2, 0, 0)), ((1, 3, -1), (1, 3, 1)), (0, -3, 0), (0.5, 0.5)),
    (((0, 0, 0), (1, 0, 0)), ((3, 4, 0), (9, 4, 0)), (-2, -4, 0), (1.0, 0.0)),
    (((0, 0, 0), (1, 0, 0)), ((0.5, 0, 2), (0.5, 0, 2)), (0, 0, -2), (0.5, None)),
])
def test_where_two_lines_are_nearest(one, other, away, shares):
    off, at_one, at_other = find_nearest_points(line(*one), line(*other))
    assert off[0] == pytest.approx(away, abs=1e-6) and at_one[0] == pytest.approx(shares[0])
    assert shares[1] is None or at_other[0] == pytest.approx(shares[1])


def test_nearest_agrees_with_looking_everywhere():
    random = np.random.default_rng(3)
    one, other = random.normal(size=(2, 40, 2, 3))
    share = np.linspace(0.0, 1.0, 201)
    points = [ends[:, :1] + share[None, :, None] * (ends[:, 1:] - ends[:, :1]) for ends in (one, other)]
    least = np.linalg.norm(points[0][:, :, None] - points[1][:, None], axis=-1).min(axis=(1, 2))
    found = np.linalg.norm(find_nearest_points(one, other)[0], axis=1)
    assert np.all(found <= least + 1e-9) and np.all(found >= least - 0.03)


def test_touching_tells_how_deep_and_which_way():
    one, other = np.array([[[[0, 0, 0], [0, 0, 1.0]]]] * 2), np.array([[[[0.25, 0, 0.5], [1, 0, 0.5]]]] * 2)
    other[1] += [0.2, 0.0, 0.0]
    found = find_capsule_contacts(one, other, (np.array([0.2]), np.array([0.1])))
    assert found.frame.tolist() == [0] and found.depth[0] == pytest.approx(0.05)
    assert found.direction[0] == pytest.approx([-1, 0, 0])
    assert (found.share_one[0], found.share_other[0]) == pytest.approx((0.5, 0))


def test_overlap_of_bodies_side_by_side(walk):
    """The same walk beside itself: hands and shoulders meet first, and it is deeper the nearer they are."""
    others = [place_motion(walk, offset=(0.0, away, 0.0)) for away in (0.2, 0.4, 0.9)]
    depth = [measure_overlap_depths([walk, other], [0, 0])[0].max() for other in others]
    assert depth[0] > depth[1] > depth[2] == 0.0


def test_episodes_join_what_overlaps_and_shares_a_body():
    places = np.full((4, 100, 2), np.nan)
    places[:, :, 0] = np.array([0.0, 10.0, 20.0, 30.0])[:, None]
    places[:, :, 1] = 0.0
    places[1, 20:30, 0] = 0.1
    places[2, 32:40, 0] = 0.1
    places[3, 80:85, 0] = 10.1
    found = find_episodes(places, 0.5, 5)
    assert [(e.bodies, e.first, e.end, e.pairs) for e in found] == [
        ((0, 1, 2), 15, 45, ((0, 1), (0, 2))), ((1, 3), 75, 90, ((1, 3),)),
    ]


def crossing(miss=0.05, speed=1.5, seconds=12.0, fps=25.0):
    """Two who walk straight through each other, and one far away who leaves."""
    times = np.arange(int(seconds * fps) + 1) / fps
    way = speed * (times - 0.5 * seconds)
    far = np.where(times[:, None] < 8.0, np.column_stack([way, np.full(len(times), 30.0)]), np.nan)
    return times, np.stack([np.column_stack([way, 0 * way]), np.column_stack([-way, 0 * way + miss]), far])


def test_episodes_that_share_a_body_at_one_time_are_one():
    """The last span joins the second pair to the first one's body long after that met its other: in between both
    episodes have that body, and would undo each other's work."""
    spans = [(0, 40, (0, 1)), (10, 90, (2, 3)), (80, 100, (1, 3)), (200, 220, (0, 2))]
    found = join_spans(spans)
    assert [(one.first, one.end, one.bodies) for one in found] == [(0, 100, (0, 1, 2, 3)), (200, 220, (0, 2))]
    for number, one in enumerate(found):
        for other in found[number + 1 :]:
            apart = one.end <= other.first or other.end <= one.first
            assert apart or not set(one.bodies) & set(other.bodies)


def test_a_meeting_is_looked_at_with_all_who_are_there_then():
    """Bodies 1 and 2 meet while 2 has 3 and 3 has 4 beside him; 0 had met 1 before, and 5 and 6 are elsewhere."""
    met = [(0, 20, (0, 1)), (10, 80, (2, 3)), (25, 45, (3, 4)), (0, 90, (5, 6)), (30, 50, (1, 2))]
    assert [(one.bodies, one.first, one.end, one.pairs) for one in find_meetings([(30, 50, (1, 2))], met)] == [
        ((1, 2, 3, 4), 30, 50, ((1, 2), (2, 3), (3, 4))),
    ]
    assert find_meetings(met, met) == join_spans(met)


def test_tracks_that_cross_are_spaced_by_the_least_smooth_shift():
    times, places = crossing()
    shifts = compute_spacing(times, places)
    apart = np.linalg.norm((places + shifts)[0] - (places + shifts)[1], axis=1)
    assert apart.min() > DISTANCE - 0.03
    assert not shifts[2].any() and not shifts[:, [0, -1]].any()
    assert np.abs(shifts[0] + shifts[1]).max() < 0.02 and np.abs(shifts).max() < 0.6 * DISTANCE
    assert np.abs(np.diff(shifts[:2], 2, axis=1)).max() * 25.0**2 < 1.5


def test_who_touches_the_ball_keeps_his_way():
    times, places = crossing()
    keep = np.ones(places.shape[:2])
    keep[0] = TOUCH_FIRMNESS
    shifts = compute_spacing(times, places, keep)
    moved = np.linalg.norm(shifts, axis=2).max(axis=1)
    assert moved[0] < 0.2 * moved[1] and moved[1] > 0.3


def test_keeping_is_firmest_at_the_touch():
    firm = compute_firmness(100, np.array([50.0]), FPS)
    assert firm[50] == TOUCH_FIRMNESS and firm[20] == 1.0 and np.all(np.diff(firm[20:51]) >= 0.0)
    assert np.all(compute_firmness(10, np.zeros(0), FPS) == 1.0)


def bump(count, at, size):
    out = np.zeros(count)
    out[at - 20 : at + 21] = size * np.hanning(41)
    return out


@pytest.fixture()
def curves(walk):
    out = np.zeros((len(walk), CURVES))
    out[:, 0], out[:, 3], out[:, 5] = bump(len(walk), 50, 0.05), bump(len(walk), 50, 0.03), bump(len(walk), 50, 0.03)
    out[:, ARMS.start + 1] = bump(len(walk), 50, 0.4)
    return out


def test_a_correction_keeps_bones_and_untouched_frames(walk, curves):
    found = Correction.from_curves(curves, 1000, FPS)
    moved = apply_correction(walk, found, 1000)
    assert np.array_equal(moved.rotations[80:], walk.rotations[80:])
    assert np.array_equal(moved.root_positions[:25], walk.root_positions[:25])
    assert found.build_curves(1000, len(walk)) == pytest.approx(curves, abs=1.5e-3)
    joints, world = forward_kinematics(moved)
    before, turned = forward_kinematics(walk)
    bones = [np.linalg.norm(p[:, 1:] - p[:, list(walk.skeleton.parents[1:])], axis=2) for p in (joints, before)]
    assert bones[0] == pytest.approx(bones[1], abs=1e-9)
    legs = identify_joints(walk.skeleton)
    for side, limb in enumerate((legs.left, legs.right)):
        off = joints[:, limb.foot] - before[:, limb.foot]
        assert off[:, :2] == pytest.approx(curves[:, FEET].reshape(-1, 2, 2)[:, side], abs=0.012)
        assert np.abs(np.sum(world[:, limb.foot] * turned[:, limb.foot], axis=1)) == pytest.approx(1.0)
    assert compute_jerk(joints, FPS).max() < 1.2 * compute_jerk(before, FPS).max()


def test_frames_are_corrected_by_themselves(walk, curves):
    whole, part = apply_curves(walk, curves), apply_curves(walk.frames(40, 70), curves[40:70])
    assert np.array_equal(whole.rotations[40:70], part.rotations)
    assert np.array_equal(whole.root_positions[40:70], part.root_positions)


def test_without_correction_the_motion_is_the_same(walk):
    assert apply_correction(walk, Correction.build_empty(FPS), 7) is walk


def test_windows_join_to_what_one_would_have_given(curves):
    whole = Correction.from_curves(curves, 0, FPS)
    parts = [Correction.from_curves(curves[:75], 0, FPS), Correction.from_curves(curves[45:], 45, FPS)]
    found = join_corrections([(parts[0], 0, 60), (parts[1], 60, 120)], 15)
    assert found.build_curves(0, len(curves)) == pytest.approx(whole.build_curves(0, len(curves)), abs=2e-3)


@pytest.mark.parametrize("knots, values, what", [
    ([3, 0], np.zeros((2, CURVES)), "rising"), ([0, 3], np.zeros((2, 5)), "values"),
    ([0], np.zeros((2, CURVES)), "knots"),
])
def test_arrays_that_are_no_correction_are_told(knots, values, what):
    with pytest.raises(InputError, match=what):
        Correction(np.array(knots), values, FPS, 3)


def test_rates_have_to_agree(walk):
    with pytest.raises(InputError, match="frames per second"):
        apply_correction(walk, Correction.build_empty(25.0))


def test_curves_have_their_columns():
    assert (ROOT.stop, FEET.stop, ARMS.stop) == (2, 6, CURVES)
