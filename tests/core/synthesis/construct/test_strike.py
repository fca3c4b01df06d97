"""Balls planted around a made kick and walk: met where they are in reach, told where not, nothing torn."""

from typing import NamedTuple

import numpy as np
import pytest

from beyond_mocap.annotation.ball_contact import build_surfaces
from beyond_mocap.annotation.striking import measure_ball_gap
from beyond_mocap.motion.contacts import detect_contacts
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion, compute_pose
from beyond_mocap.synthesis.construct.ball_touch.part_reach import MAX_DROP, MAX_SHIFT
from beyond_mocap.synthesis.construct.ball_touch.touch_frames import Touch
from beyond_mocap.synthesis.construct.ball_touch.touch_problem import BALL_NOISE
from beyond_mocap.synthesis.construct.step_to_ball import FAST_STEP, SLOW_STEP, compute_allowed_step
from beyond_mocap.synthesis.construct.strike import strike_ball
from beyond_mocap.synthetic import gestures
from beyond_mocap.synthetic.gait import build_gait

FPS = 30.0
ENTRY = 8.0
KICK = ("kick", "low", "right")


@pytest.fixture(scope="module")
def kick():
    return gestures.build_strike("kick low inside", fps=FPS)


def kinematics(motion, struck=None):
    root, rotations = (motion.root_positions, motion.rotations) if struck is None else (struck.root, struck.rotations)
    return compute_pose(motion.skeleton, root, rotations)


def met(gesture, ball, *touches, contacts=None, **known):
    motion = gesture.motion
    contacts = detect_contacts(motion) if contacts is None else contacts
    path = np.broadcast_to(ball, (len(motion), 3)) if np.ndim(ball) == 1 else ball
    return strike_ball(motion.skeleton, motion.root_positions, motion.rotations, contacts, path, touches, FPS, **known)


def touch(gesture, words=KICK, at=0.0):
    return Touch(gesture.key * FPS + at, tuple(words), ENTRY, ENTRY)


def natural_ball(gesture, at=0.0):
    """Where the right foot strikes a ball as recorded: ahead of the foot's middle, on the ground."""
    places, _ = kinematics(gesture.motion)
    limb, frame = identify_joints(gesture.motion.skeleton).right, int(round(gesture.key * FPS + at))
    return np.array([*(0.5 * (places[frame, limb.foot] + places[frame, limb.toe]))[:2] + [0.2, 0.0], 0.11])


def gaps(motion, struck, frame, words):
    """Gap of every part that the words name, at one frame."""
    pose = [values[frame] for values in kinematics(motion, struck)]
    return [measure_ball_gap(s.compute_line(*pose), s.radius, struck.ball[frame])
            for s in build_surfaces(motion.skeleton, words)]


def check_whole(motion, struck, changed=slice(None)):
    """Numbers everywhere, bones as they were, pelvis on its track, the ball above the ground, nothing else changed."""
    assert all(np.isfinite(values).all() for values in (struck.root, struck.rotations, struck.ball))
    before, after = kinematics(motion)[0], kinematics(motion, struck)[0]
    parents = list(motion.skeleton.parents[1:])
    lengths = [np.linalg.norm(p[:, 1:] - p[:, parents], axis=-1) for p in (before, after)]
    assert np.allclose(*lengths, atol=1e-9)
    assert np.array_equal(struck.root[:, :2], motion.root_positions[:, :2])
    sunk = motion.root_positions[:, 2] - struck.root[:, 2]
    assert sunk.min() >= 0.0 and sunk.max() <= MAX_DROP + 1e-9
    assert struck.ball[:, 2].min() >= 0.11
    outside = np.ones(len(motion), bool)
    outside[changed] = False
    assert np.array_equal(struck.rotations[outside], motion.rotations[outside])
    assert np.array_equal(struck.root[outside], motion.root_positions[outside])


@pytest.mark.parametrize("at", [0.0, 0.4, -0.3])
@pytest.mark.parametrize("off", [(0.0, 0.0), (0.2, 0.1), (0.4, 0.0), (0.3, -0.25), (-0.3, 0.2)])
def test_a_ball_in_reach_is_met_in_both_frames_around_the_moment(kick, off, at):
    struck = met(kick, natural_ball(kick, at) + [*off, 0.0], touch(kick, at=at))
    frame = kick.key * FPS + at
    first, last = (int(f(frame - 1e-6)) for f in (np.floor, np.ceil))
    assert struck.gap[0] < 0.005 and struck.ball_shift[0] <= BALL_NOISE + 1e-9
    assert struck.moved[0] <= MAX_SHIFT["foot"] + 1e-3
    check_whole(kick.motion, struck, slice(int(frame - ENTRY), int(frame + ENTRY) + 2))
    near = int(round(frame))
    assert abs(gaps(kick.motion, struck, near, KICK)[0]) < 0.005
    if at and off == (0.0, 0.0):
        assert max(abs(gaps(kick.motion, struck, f, KICK)[0]) for f in (first, last)) < 0.02


def test_a_ball_within_its_noise_comes_to_the_foot_as_recorded(kick):
    struck = met(kick, natural_ball(kick) + [0.1, 0.05, 0.0], touch(kick))
    assert struck.moved[0] < 1e-6 and 0.0 < struck.ball_shift[0] < 0.2
    assert np.allclose(struck.rotations, kick.motion.rotations, atol=1e-9)


def test_the_other_foot_and_a_standing_foot_stay(kick):
    struck = met(kick, natural_ball(kick) + [0.4, 0.0, 0.0], touch(kick))
    body = identify_joints(kick.motion.skeleton)
    before, after = kinematics(kick.motion)[0], kinematics(kick.motion, struck)[0]
    assert struck.moved[0] > 0.1
    assert np.abs(after - before)[:, [body.left.foot, body.left.toe]].max() < 0.002
    standing = detect_contacts(kick.motion)[:, 1]
    assert np.abs(after - before)[standing][:, body.right.foot].max() < 0.002


def test_no_pop(kick):
    motion = kick.motion
    struck = met(kick, natural_ball(kick) + [0.4, 0.0, 0.0], touch(kick))
    jerk = [np.abs(np.diff(kinematics(motion, s)[0], 3, axis=0)).max() for s in (None, struck)]
    assert jerk[1] < 1.7 * jerk[0]
    flight = np.linalg.norm(np.diff(struck.ball, 2, axis=0), axis=1) * FPS**2
    assert flight.max() < 35.0  # a shift of 0.3 m within 0.3 s


def knee(motion, struck=None):
    """(T,) degrees inside the right knee."""
    places, limb = kinematics(motion, struck)[0], identify_joints(motion.skeleton).right
    up, down = (places[:, joint] - places[:, limb.lower_leg] for joint in (limb.upper_leg, limb.foot))
    cosine = np.sum(up * down, axis=1) / np.linalg.norm(up, axis=1) / np.linalg.norm(down, axis=1)
    return np.degrees(np.arccos(cosine))


@pytest.mark.parametrize("off", [(0.6, 0.1, 0.0), (0.5, -0.3, 0.0), (-0.5, 0.1, 0.0), (0.4, 0.0, 0.5)])
def test_the_knee_neither_locks_nor_snaps(kick, off):
    struck = met(kick, natural_ball(kick) + off, touch(kick))
    before, after = knee(kick.motion), knee(kick.motion, struck)
    assert struck.moved[0] > 0.1
    assert after.max() < max(170.0, before.max()) + 0.5 and after.min() > min(35.0, before.min()) - 0.5
    assert np.abs(np.diff(after)).max() < 1.6 * np.abs(np.diff(before)).max()


def test_a_ball_does_not_lie_in_the_other_leg(kick):
    body, frame = identify_joints(kick.motion.skeleton), int(round(kick.key * FPS))
    ankle = kinematics(kick.motion)[0][frame, body.left.foot]
    struck = met(kick, np.array([*ankle[:2], 0.11]), touch(kick))
    pose = [values[frame] for values in kinematics(kick.motion, struck)]
    left, _ = build_surfaces(kick.motion.skeleton, ("kick",))
    shin = tuple(pose[0][joint] for joint in (body.left.lower_leg, body.left.foot))
    assert struck.moved[0] > 0.0
    assert min(measure_ball_gap(line, left.radius, struck.ball[frame]) for line in (left.compute_line(*pose),
                                                                                    shin)) > -1e-6


@pytest.mark.parametrize("off", [(2.0, 0.0), (-1.5, 1.0), (0.0, -3.0)])
def test_a_ball_out_of_reach_is_told_and_the_body_plays_as_recorded(kick, off):
    struck = met(kick, natural_ball(kick) + [*off, 0.0], touch(kick))
    assert struck.gap[0] > 1.0 and struck.moved[0] == 0.0
    check_whole(kick.motion, struck, slice(0, 0))


def test_a_filled_ball_comes_further(kick):
    ball = natural_ball(kick) + [0.8, 0.3, 0.0]
    struck = met(kick, ball, touch(kick), measured=np.zeros(len(kick.motion), bool))
    assert struck.gap[0] < 0.005 and BALL_NOISE < struck.ball_shift[0] < 1.0


def test_a_filled_ball_in_the_air_comes_down_to_a_low_foot(kick):
    ball = natural_ball(kick) + [0.0, 0.0, 0.7]
    struck = met(kick, ball, touch(kick), measured=np.zeros(len(kick.motion), bool))
    assert struck.gap[0] < 0.005 and struck.moved[0] < 0.05


def test_a_ball_in_the_air_stays_near_its_height(kick):
    ball = natural_ball(kick) + [0.0, 0.0, 0.4]
    struck = met(kick, ball, touch(kick))
    near = int(round(kick.key * FPS))
    assert ball[2] - struck.ball[near, 2] <= BALL_NOISE + 1e-9
    check_whole(kick.motion, struck)


def test_two_touches_do_not_spoil_each_other(kick):
    soon = touch(kick, at=6.0)
    struck = met(kick, natural_ball(kick) + [0.35, 0.0, 0.0], touch(kick), soon)
    alone = met(kick, natural_ball(kick) + [0.35, 0.0, 0.0], touch(kick))
    assert struck.gap[0] < 0.005 and alone.gap[0] < 0.005
    given_late_first = met(kick, natural_ball(kick) + [0.35, 0.0, 0.0], soon, touch(kick))
    assert np.array_equal(given_late_first.rotations, struck.rotations)
    assert np.array_equal(given_late_first.gap[::-1], struck.gap)


class Walk(NamedTuple):
    """A walk in which something is met in the middle."""

    motion: Motion
    key: float = 1.0


@pytest.fixture(scope="module")
def walk():
    return Walk(build_gait(1.4, 2.0, FPS))


@pytest.mark.parametrize("words", [("header",), ("throwb",), ("throw", "left"), ("receive", "body")])
def test_head_chest_and_hands_meet_a_ball_of_unknown_height(walk, words):
    places, _ = kinematics(walk.motion)
    near = int(walk.key * FPS)
    ball = np.array([*places[near, identify_joints(walk.motion.skeleton).head, :2] + [0.2, 0.1], 0.11])
    struck = met(walk, ball, touch(walk, words), height_known=np.zeros(len(walk.motion), bool))
    assert struck.gap[0] < 0.005 and struck.ball[near, 2] > 0.5
    check_whole(walk.motion, struck)
    assert max(map(abs, gaps(walk.motion, struck, near, words))) < 0.005
    assert struck.ball[near - 20, 2] == struck.ball[near + 20, 2] == 0.11


@pytest.mark.parametrize("away, is_met", [(2.3, True), (2.7, False)])
def test_a_ball_that_is_thrown_is_in_the_hands_where_the_feed_has_it_beside_the_player(walk, away, is_met):
    near = int(walk.key * FPS)
    place = kinematics(walk.motion)[0][near, identify_joints(walk.motion.skeleton).hips] * [1.0, 1.0, 0.0]
    struck = met(walk, place + [0.0, away, 0.11], touch(walk, ("throwb", "high")))
    assert (struck.gap[0] < 0.005) == (struck.ball_shift[0] > 1.5) == is_met
    assert met(walk, place + [0.0, 2.3, 0.11], touch(walk, ("punch", "high"))).gap[0] > 1.0


def test_a_ball_of_unknown_height_flies_freely(walk):
    ball = kinematics(walk.motion)[0][30, identify_joints(walk.motion.skeleton).head] * [1.0, 1.0, 0.0] + [0.25, 0.0,
            0.11]
    struck = met(walk, ball, touch(walk, ("header",)), height_known=np.zeros(len(walk.motion), bool))
    fall = np.diff(struck.ball[30:42, 2], 2) * FPS**2
    assert np.allclose(fall, -9.81, atol=1e-6)


def test_the_head_bends_to_a_ball_of_known_height(walk):
    head = kinematics(walk.motion)[0][30, identify_joints(walk.motion.skeleton).head]
    struck = met(walk, head + [0.58, 0.1, 0.2], touch(walk, ("header",)))
    assert struck.gap[0] < 0.005 and 0.02 < struck.moved[0] < 0.2
    assert np.array_equal(struck.root, walk.motion.root_positions)


def test_without_a_ball_or_a_part_nothing_happens(kick):
    for ball, words in ((np.full(3, np.nan), KICK), (natural_ball(kick), ("walking",))):
        struck = met(kick, ball, touch(kick, words))
        assert np.isnan([struck.gap[0], struck.ball_shift[0], struck.moved[0]]).all()
        assert np.array_equal(struck.rotations, kick.motion.rotations)
    assert met(kick, natural_ball(kick)).gap.shape == (0,)


@pytest.mark.parametrize("frame", [0.0, 0.5, 1e9])
def test_touches_at_the_ends_of_the_motion(kick, frame):
    struck = met(kick, natural_ball(kick), Touch(frame, KICK, ENTRY, ENTRY))
    assert np.isfinite(struck.rotations).all() and np.isfinite(struck.gap).all()


def test_inputs_are_not_changed_and_results_repeat(kick):
    root, rotations = kick.motion.root_positions, kick.motion.rotations
    ball = np.tile(natural_ball(kick), (len(kick.motion), 1))
    kept = ball.copy()
    first, second = (met(kick, ball, touch(kick)) for _ in range(2))
    assert np.array_equal(ball, kept) and not root.flags.writeable and not rotations.flags.writeable
    assert np.array_equal(first.rotations, second.rotations) and np.array_equal(first.ball, second.ball)


def reaching(walk):
    """A ball that flies past the left hand, ten metres a second, nearest 6 frames after frame 30."""
    places, _ = kinematics(walk.motion)
    wrist = places[36, identify_joints(walk.motion.skeleton).left.hand]
    seconds = (np.arange(len(walk.motion)) - 36) / FPS
    return wrist + [0.05, 0.25, 0.1] + seconds[:, None] * [-10.0, 0.0, 0.0]


def test_a_hand_meets_the_ball_on_the_flight_of_a_dive(walk):
    ball = reaching(walk)
    struck = met(walk, ball, Touch(30.0, ("dive", "right"), 10.0, 40.0))
    assert min(gaps(walk.motion, struck, 36, ("dive",))) == pytest.approx(0.0, abs=0.005)
    assert struck.gap[0] < 0.005 and struck.ball_shift[0] <= BALL_NOISE + 1e-9
    check_whole(walk.motion, struck, slice(20, 56))
    before, after = kinematics(walk.motion)[0], kinematics(walk.motion, struck)[0]
    other = identify_joints(walk.motion.skeleton).right.hand
    assert np.allclose(before[:, other], after[:, other], atol=1e-9)  # the other arm stays with the dive


def test_what_is_no_dive_meets_the_ball_at_its_key_or_not_at_all(walk):
    ball = reaching(walk)
    struck = met(walk, ball, Touch(30.0, ("catchb", "high"), 10.0, 40.0))
    assert struck.gap[0] > 1.0
    assert np.array_equal(struck.rotations, walk.motion.rotations)


def test_the_pelvis_steps_to_a_ball_that_a_standing_leg_just_misses(kick):
    """Farther than the foot reaches, by less than the pelvis may step; the standing foot stays where it was."""
    ball = natural_ball(kick)
    places, _ = kinematics(kick.motion)
    near, human = int(round(kick.key * FPS)), identify_joints(kick.motion.skeleton)
    away = ball[:2] - places[near, human.hips, :2]
    far = ball + [*(1.16 / np.linalg.norm(away) - 1.0) * away, 0.0]
    struck = met(kick, far, touch(kick))
    moved = np.linalg.norm(struck.root[:, :2] - kick.motion.root_positions[:, :2], axis=1)
    assert struck.gap[0] < 0.005 and 0.01 < moved.max() <= SLOW_STEP + 1e-9
    assert moved.argmax() in (near - 1, near, near + 1)
    after = kinematics(kick.motion, struck)[0]
    assert np.linalg.norm(after - places, axis=2)[:, human.left.foot].max() < 0.006


def test_a_runner_steps_less_off_the_track():
    assert compute_allowed_step(0.3) == SLOW_STEP and compute_allowed_step(5.0) == FAST_STEP
    assert FAST_STEP < compute_allowed_step(1.5) < SLOW_STEP
