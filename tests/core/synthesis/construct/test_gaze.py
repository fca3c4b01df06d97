"""Bodies that watch a ball: head first, then shoulders, within their ranges and speeds, and nothing below the spine."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthesis.construct.gaze import (
    EYE_ANGLE,
    MAX_TWIST,
    MAX_YAW,
    MEMORY_SECONDS,
    compute_attention,
    compute_bearing,
    compute_release,
    compute_twist,
    draw_habits,
    hide_lost_ball,
    watch_ball,
)
from beyond_mocap.synthesis.construct.pins import estimate_look_axis
from beyond_mocap.synthetic.gait import build_gait

FPS = 30.0
SEED = 5


@pytest.fixture(scope="module")
def standing():
    return build_gait(0.0, 12.0, FPS, seed=4)


@pytest.fixture(scope="module")
def look(standing):
    return estimate_look_axis(standing.skeleton, standing.rotations)


@pytest.fixture(scope="module")
def watch(standing, look):
    """watch(ball, motion=standing, speed=0, ...) -> the motion that watches."""

    def run(ball, motion=standing, speed=0.0, **more):
        return watch_ball(motion, ball, look=look, speed=np.full(len(motion), speed), **{"seed": SEED, **more})

    return run


def facing(places, left, right):
    across = places[:, left] - places[:, right]
    return np.arctan2(-across[:, 0], across[:, 1])


def sight(motion, look):
    """(T, 3) unit where the head looks, and (T, 3) m where it is."""
    places, world = forward_kinematics(motion)
    head = identify_joints(motion.skeleton).head
    return quaternion.rotate(world[:, head], np.broadcast_to(look, (len(motion), 3))), places[:, head]


def angles(motion, look):
    """(T,) degrees: the head's yaw against the shoulders, and the shoulders' against the hips."""
    body, (places, _) = identify_joints(motion.skeleton), forward_kinematics(motion)
    way, _ = sight(motion, look)
    hips = facing(places, body.left.upper_leg, body.right.upper_leg)
    shoulders = facing(places, body.left.upper_arm, body.right.upper_arm)
    yaw = quaternion.wrap_angle(np.arctan2(way[:, 1], way[:, 0]) - shoulders)
    return np.degrees(yaw), np.degrees(quaternion.wrap_angle(shoulders - hips))


def off(motion, look, ball):
    """(T,) degrees between where the head looks and the ball."""
    way, head = sight(motion, look)
    away = ball - head
    return np.degrees(np.arccos(np.clip(np.sum(way * away, axis=1) / np.linalg.norm(away, axis=1), -1.0, 1.0)))


def bearing_ball(motion, degrees, distance=3.5):
    """A ball on a circle round the body, at bearings (T,)."""
    angle = np.broadcast_to(np.radians(degrees), len(motion))
    return np.column_stack([distance * np.cos(angle), distance * np.sin(angle), np.full(len(motion), 1.5)])


def jumping(motion, degrees=50.0, at=180):
    return bearing_ball(motion, np.where(np.arange(len(motion)) < at, 0.0, degrees))


def speed_of(degrees):
    return np.abs(np.diff(degrees)) * FPS


def test_the_head_turns_first_and_the_shoulders_later(standing, look, watch):
    before = angles(watch(bearing_ball(standing, 0.0)), look)
    head, shoulders = (now - then for now, then in zip(angles(watch(jumping(standing)), look), before))
    in_space = head + shoulders
    half = [np.argmax(turn > 0.5 * turn[-90:].mean()) - 180 for turn in (in_space, shoulders)]
    assert 0.1 * FPS <= half[0] <= 0.45 * FPS  # seen late, and turned at the speed of a head
    assert 0.08 * FPS <= half[1] - half[0] <= 0.3 * FPS
    assert 20.0 < shoulders[-90:].mean() < 40.0 and 35.0 < in_space[-90:].mean() < 50.0
    assert np.abs(in_space[:165]).max() < 1.0 and np.abs(shoulders[:165]).max() < 1.0


def test_the_head_stops_short_of_the_ball_by_what_eyes_do(standing, look, watch):
    """Planted: a ball that goes slowly from side to side, up and down, within what a neck can."""
    times = np.arange(len(standing)) / FPS
    angle, height = 1.1 * np.sin(0.5 * times), 1.6 + 0.9 * np.sin(0.4 * times)
    ball = np.column_stack([3.0 * np.cos(angle), 3.0 * np.sin(angle), height])
    assert off(standing, look, ball).max() > 60.0
    assert off(watch(ball), look, ball).max() < np.degrees(EYE_ANGLE) + 8.0


@pytest.mark.parametrize("way", ["overhead", "behind", "beside", "from side to side"])
def test_nothing_snaps(standing, look, watch, way):
    """A fast ball over the head, round the back, past the shoulder, or at once elsewhere."""
    x = np.linspace(-12.0, 12.0, len(standing))
    ball = {
        "overhead": np.column_stack([x, 0.02 + 0 * x, 3.2 + 0 * x]),
        "behind": np.column_stack([-2.0 + 0 * x, 0.6 * x, 0.4 + 0 * x]),
        "beside": np.column_stack([x, 1.0 + 0 * x, 1.0 + 0 * x]),
        "from side to side": bearing_ball(standing, np.where(np.arange(len(standing)) < 180, -85.0, 85.0)),
    }[way]
    found = watch(ball)
    seen, _ = sight(found, look)
    speed = np.degrees(np.linalg.norm(np.diff(seen, axis=0), axis=1)) * FPS
    assert speed.max() < 400.0
    assert np.abs(np.diff(speed)).max() * FPS < 2500.0
    assert (speed_of(angles(found, look)[1]) - speed_of(angles(standing, look)[1])).max() < 150.0


def test_turns_stay_within_the_ranges_of_neck_and_trunk(standing, look, watch):
    own = angles(standing, look)
    for degrees in (60.0, 90.0, 119.0):
        yaw, twist = angles(watch(bearing_ball(standing, degrees)), look)
        assert yaw.max() < np.degrees(MAX_YAW) + 3.0
        assert np.degrees(MAX_TWIST) - 8.0 < (twist - own[1]).max() and twist.max() < np.degrees(MAX_TWIST) + 3.0
    yaw, _ = angles(watch(bearing_ball(standing, 90.0), shoulder_share=0.0), look)
    assert np.degrees(MAX_YAW) - 15.0 < yaw.max() < np.degrees(MAX_YAW) + 3.0
    yaw, twist = angles(watch(bearing_ball(standing, 180.0)), look)
    assert np.abs(yaw).max() < 15.0 and np.abs(twist - own[1]).max() < 1.0  # no one looks through their own head


def test_a_twist_that_the_clip_has_counts_towards_the_range():
    seen = np.tile([0.1, 4.0, 0.0], (300, 1))
    for own in np.radians([-30.0, 0.0, 20.0, 37.0, 60.0]):
        twist = compute_twist(seen, np.full(300, own), FPS)
        assert np.all(twist >= 0.0) and np.all(own + twist <= max(MAX_TWIST, own) + 1e-9)
        mirrored = compute_twist(seen * [1.0, -1.0, 1.0], np.full(300, -own), FPS)
        np.testing.assert_allclose(mirrored, -twist, atol=1e-12)
    assert compute_twist(seen, np.full(300, -0.5), FPS).min() > 0.9 * compute_twist(seen, np.zeros(300), FPS).max()


def test_bearings_have_no_edge_but_straight_up():
    """All round the body and at every height but straight up and down, a degree makes a small difference."""
    turn = np.radians(np.arange(-180.0, 180.5, 0.5))
    for up in np.radians(np.arange(-70.0, 71.0, 10.0)):
        seen = np.column_stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up) + 0 * turn])
        found = np.column_stack(compute_bearing(seen))
        assert np.abs(np.diff(found, axis=0)).max() < np.radians(2.5)
        np.testing.assert_allclose(found[0], found[-1], atol=1e-6)
        assert np.abs(found[:, 0]).max() <= np.pi / 2.0 + 1e-9
    mirrored = np.column_stack(compute_bearing(seen * [1.0, -1.0, 1.0]))
    np.testing.assert_allclose(mirrored * [-1.0, 1.0], found, atol=1e-12)


def test_hips_legs_and_feet_keep_their_bits(standing, watch):
    found, body = watch(jumping(standing)), identify_joints(standing.skeleton)
    turned = {*body.spine, body.neck, body.head}
    changed = np.flatnonzero(np.any(found.rotations != standing.rotations, axis=(0, 2)))
    assert set(changed) == turned and body.hips not in turned
    assert np.array_equal(found.root_positions, standing.root_positions)
    feet = [joint for limb in (body.left, body.right) for joint in (limb.foot, limb.toe_or_foot)]
    before, after = (forward_kinematics(motion)[0][:, feet] for motion in (standing, found))
    assert np.array_equal(before, after)


def test_released_frames_keep_their_bits(standing, watch):
    share = compute_release([(100.0, 140.0)], len(standing), 15.0)
    assert np.all(share[100:141] == 0.0) and share[85] == share[155] == 1.0 and 0.0 < share[92] < 1.0
    found = watch(jumping(standing, 50.0, 0), head_share=share, shoulder_share=share)
    assert np.array_equal(found.rotations[100:141], standing.rotations[100:141])
    assert not np.array_equal(found.rotations[:85], standing.rotations[:85])


def test_an_edit_of_the_ball_stays_local(standing, watch):
    """A ball that is elsewhere for a second: two seconds before and after, every bit is as it was."""
    at = np.arange(len(standing))
    plain = bearing_ball(standing, 40.0 * np.sin(0.05 * at))
    other = np.where(((at >= 180) & (at < 210))[:, None], plain * [-1.0, 1.0, 1.0], plain)
    a, b = watch(plain), watch(other)
    apart = np.flatnonzero(np.any(a.rotations != b.rotations, axis=(1, 2)))
    assert 180 - 30 <= apart[0] and apart[-1] < 210 + 60


def test_a_part_watches_as_the_whole_does(standing, look, watch):
    """Attention is a matter of the clock, not of where a motion begins."""
    ball = bearing_ball(standing, 40.0 * np.sin(0.05 * np.arange(len(standing))), 20.0)
    whole = watch(ball, start=100.0)
    part = watch(ball[90:300], standing.frames(90, 300), start=100.0 + 90 / FPS)
    np.testing.assert_allclose(part.rotations[45:-45], whole.rotations[135:255], atol=1e-9)


def test_players_watch_each_in_their_own_way(standing, look, watch):
    ball = jumping(standing, 60.0)
    same, one, other = (watch(ball, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(same.rotations, one.rotations)
    assert np.abs(angles(one, look)[0] - angles(other, look)[0]).max() > 3.0


def test_attention_is_full_for_a_near_ball_and_wanders_for_a_far_one():
    times = np.arange(0.0, 120.0, 1.0 / FPS)
    still = np.zeros(len(times))
    near, on_pitch, far = (compute_attention(draw_habits(SEED), times, still + distance, still, FPS)
                           for distance in (3.0, 15.0, 80.0))
    assert near.min() > 0.999
    assert on_pitch.min() < 0.6 and on_pitch.max() > 0.95 and on_pitch.mean() > far.mean() + 0.1
    assert far.min() < 0.3 and np.abs(np.diff(on_pitch)).max() * FPS < 1.0
    running = compute_attention(draw_habits(SEED), times, still + 15.0, still + 1.0, FPS)
    assert running.mean() < 0.5 * on_pitch.mean()
    assert compute_attention(draw_habits(SEED), times, still + 3.0, still + 1.0, FPS).min() > 0.999


def test_a_sprinter_turns_less(standing, look, watch):
    ball = bearing_ball(standing, 60.0, 15.0)
    slow, fast = (np.abs(angles(watch(ball, speed=speed), look)[1]).mean() for speed in (3.0, 8.0))
    assert fast < 0.6 * slow


def test_nothing_to_see_changes_nothing(standing, watch):
    ball = np.full((len(standing), 3), np.nan)
    assert watch(ball) is standing
    ball[:60] = [3.0, 2.0, 1.0]
    found = watch(ball)
    assert np.all(np.isfinite(found.rotations))
    assert np.array_equal(found.rotations[60:], standing.rotations[60:])
    assert not np.array_equal(found.rotations[:40], standing.rotations[:40])


def test_a_lost_ball_is_watched_for_a_while_only():
    measured = np.ones(300, bool)
    measured[100:250] = False
    seen = np.isfinite(hide_lost_ball(np.zeros((300, 3)), measured, FPS)).all(axis=1)
    memory = int(MEMORY_SECONDS * FPS)
    assert seen[: 100 + memory - 1].all() and seen[250 - memory :].all()
    assert not seen[100 + memory : 250 - memory - 1].any()
    assert not np.isfinite(hide_lost_ball(np.zeros((300, 3)), ~np.ones(300, bool), FPS)).any()


def test_a_skeleton_without_neck_and_head_only_twists(standing, look):
    body = identify_joints(standing.skeleton)
    keep = [joint for joint in range(len(standing.skeleton)) if joint not in (body.neck, body.head)]
    number = {joint: index for index, joint in enumerate(keep)}
    skeleton = standing.skeleton
    headless = replace(
        skeleton, names=tuple(skeleton.names[joint] for joint in keep), offsets=skeleton.offsets[keep],
        parents=tuple(number.get(skeleton.parents[joint], -1) for joint in keep), end_parents=(),
        end_offsets=np.zeros((0, 3)),
    )  # fmt: skip
    motion = replace(standing, skeleton=headless, rotations=standing.rotations[:, keep])
    found = watch_ball(motion, bearing_ball(motion, 60.0), look=look, speed=np.zeros(len(motion)))
    changed = set(np.flatnonzero(np.any(found.rotations != motion.rotations, axis=(0, 2))))
    assert changed == set(identify_joints(headless).spine)
