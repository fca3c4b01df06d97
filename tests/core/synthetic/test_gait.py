"""The made gait: it goes where it is asked to, its feet stay where they stand, and its figures are a person's."""

import pathlib

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion.humanoid import compute_heading, identify_joints, measure_leg_length
from beyond_mocap.motion.motion import Motion, compute_end_positions, forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.synthetic import gestures, moves
from beyond_mocap.synthetic.gait import GaitStyle, build_gait, plan_footsteps, plan_gait

MOCAP = pathlib.Path(__file__).parents[3] / "../shared/data/mocap"
FPS = 60.0


def flexion(motion: Motion) -> np.ndarray:
    """Flexion (T, 2) of the knees in degrees."""
    places, _ = forward_kinematics(motion)
    body = identify_joints(motion.skeleton)
    angles = []
    for limb in (body.left, body.right):
        thigh, shank = (
            places[:, limb.lower_leg] - places[:, limb.upper_leg],
            places[:, limb.foot] - places[:, limb.lower_leg],
        )
        cosine = np.sum(thigh * shank, axis=1) / np.linalg.norm(thigh, axis=1) / np.linalg.norm(shank, axis=1)
        angles.append(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    return np.stack(angles, axis=1)


def standing_toes(motion: Motion, speed, **way) -> np.ndarray:
    """Speeds (N,) m/s over the ground of toe joints in the middle of their foot's stance, both feet together."""
    neutral = build_neutral_stance(motion.skeleton)
    course = plan_gait(speed, None if np.ndim(speed) else motion.duration, motion.fps, neutral, **way)
    times = course.times[course.requested_slice]
    places, _ = forward_kinematics(motion)
    body = identify_joints(motion.skeleton)
    found = []
    for side, limb in enumerate((body.left, body.right)):
        steps = plan_footsteps(course, neutral, GaitStyle(), side)
        which = steps.find_stance(times)
        share = (times - steps.on[which]) / (steps.off[which] - steps.on[which])
        flat = (share > 0.3) & (share < 0.6)
        travel = np.linalg.norm(np.diff(places[:, limb.toe_or_foot, :2], axis=0), axis=1) * motion.fps
        found.append(travel[flat[1:] & flat[:-1]])
    return np.concatenate(found)


@pytest.mark.parametrize("speed", [0.0, 0.5, 1.4, 2.0, 2.2, 3.0, 4.5, 6.5, 9.5])
def test_goes_as_fast_as_asked_and_keeps_to_the_path(speed):
    motion = build_gait(speed, 5.0, FPS)
    way = np.arange(len(motion)) / FPS * speed
    assert len(motion) == 301
    assert np.max(np.abs(motion.root_positions[:, 0] - way)) < 0.09
    assert np.max(np.abs(motion.root_positions[:, 1])) < 0.06


@pytest.mark.parametrize("speed", [0.0, 0.8, 1.4, 2.6, 4.0, 6.0, 9.0])
def test_standing_feet_do_not_slide_nor_sink(speed):
    motion = build_gait(speed, 5.0, FPS)
    assert np.max(standing_toes(motion, speed)) < 0.01
    places, _ = forward_kinematics(motion)
    lowest = min(places[..., 2].min(), compute_end_positions(motion)[..., 2].min())
    assert lowest > -0.003


def test_a_sprint_from_standing_and_back_keeps_its_feet_planted():
    speed = np.interp(np.arange(int(10 * FPS)) / FPS, [0, 1, 5, 6, 9, 10], [0, 0, 8.2, 8.2, 0, 0])
    motion = build_gait(speed, fps=FPS)
    assert np.quantile(standing_toes(motion, speed), 0.99) < 0.02
    assert motion.root_positions[-1, 0] == pytest.approx(np.sum(speed) / FPS, abs=0.1)


def test_knees_bend_as_in_the_books():
    walking, running, sprinting = (flexion(build_gait(v, 6.0, FPS, style=GaitStyle(life=0.0))) for v in (1.4, 3.5, 9.0))
    assert 55 < walking.max() < 72 and walking.min() < 14  # Winter 1991: 64 in swing
    assert 85 < running.max() < 112  # Novacheck 1998: about 90
    assert 135 < sprinting.max() < 151  # a recorded sprinter: 146
    assert min(np.quantile(k, 0.02) for k in (walking, running, sprinting)) > 0.0


@pytest.mark.parametrize(
    ("speed", "steps_per_minute"),
    [(1.0, (92, 108)), (1.4, (108, 122)), (3.0, (150, 172)), (5.0, (170, 192)), (9.0, (245, 275))],
)
def test_cadence(speed, steps_per_minute):
    neutral = build_neutral_stance(build_adult_skeleton())
    course = plan_gait(speed, 10.0, FPS, neutral, style=GaitStyle(life=0.0))
    asked = course.phase[course.requested_slice]
    assert steps_per_minute[0] < 2 * 60 * (asked[-1] - asked[0]) / 10.0 < steps_per_minute[1]


def test_walking_has_double_support_and_running_flies():
    neutral = build_neutral_stance(build_adult_skeleton())
    for speed, both, none in ((1.4, True, False), (3.5, False, True)):
        course = plan_gait(speed, 6.0, FPS, neutral)
        down = [plan_footsteps(course, neutral, GaitStyle(), side).is_in_contact(course.times[course.requested_slice])
                for side in (0, 1)]
        assert np.any(down[0] & down[1]) == both and np.any(~down[0] & ~down[1]) == none


def test_high_over_the_standing_leg_in_walking_low_in_running():
    neutral = build_neutral_stance(build_adult_skeleton())
    for speed, sign in ((1.4, 1.0), (3.5, -1.0)):
        motion = build_gait(speed, 6.0, FPS, style=GaitStyle(life=0.0))
        course = plan_gait(speed, 6.0, FPS, neutral, style=GaitStyle(life=0.0))
        left = plan_footsteps(course, neutral, GaitStyle(life=0.0), 0)
        middles = 0.5 * (left.on + left.off)
        times = np.arange(len(motion)) / FPS
        middles = middles[(middles > 0.5) & (middles < 5.5)]
        height = motion.root_positions[:, 2]
        assert np.all(sign * (np.interp(middles, times, height) - height.mean()) > 0.005)


def test_turns_and_other_directions():
    turning = build_gait(1.3, 4.0, FPS, turn_rate=0.6)
    assert compute_heading(turning)[-1] == pytest.approx(2.4, abs=0.25)
    back = build_gait(1.1, 4.0, FPS, direction=np.pi)
    assert back.root_positions[-1, 0] == pytest.approx(-4.4, abs=0.1) and abs(compute_heading(back)[-1]) < 0.2
    left = build_gait(0.9, 4.0, FPS, direction=np.pi / 2)
    places, _ = forward_kinematics(left)
    body = identify_joints(left.skeleton)
    assert left.root_positions[-1, 1] == pytest.approx(3.6, abs=0.1)
    assert np.min(places[:, body.left.foot, 1] - places[:, body.right.foot, 1]) > 0.0  # legs do not cross


def test_same_input_same_bits_and_a_seed_that_matters():
    first, again, other = (build_gait(1.4, 3.0, seed=s) for s in (4, 4, 5))
    assert np.array_equal(first.rotations, again.rotations) and np.array_equal(
        first.root_positions, again.root_positions
    )
    assert not np.array_equal(first.rotations, other.rotations)


def test_a_child_takes_shorter_quicker_steps():
    child = build_adult_skeleton(1.3)
    neutral = build_neutral_stance(child)
    grown = build_neutral_stance(build_adult_skeleton())
    strides = [np.ptp(plan_gait(1.2, 5.0, FPS, n, style=GaitStyle(life=0.0)).phase) for n in (child and neutral, grown)]
    assert strides[0] > 1.05 * strides[1]
    assert (
        build_gait(1.2, 3.0, FPS, child).root_positions[:, 2].mean() < 0.75
        * build_gait(1.2, 3.0, FPS).root_positions[:, 2].mean()
    )


def test_bad_speeds_and_lengths_are_refused():
    for arguments in ((-1.0, 2.0), (9.8, 2.0), (float("nan"), 2.0), (1.0, None), (np.ones(10), 5.0)):
        with pytest.raises(InputError):
            build_gait(*arguments)


@pytest.mark.parametrize(
    "clip",
    ["cmu10/10_04.bvh", "lafan1/multipleActions1_subject1_walk_filtered.bvh", "runs15/sie_humanoid3d_run_forward00.bvh",
     "bandai/dataset-1_dash_active_001.bvh", "sprinter/run0350cms.bvh", "lmd/Player1/P1_S01_penalty_kick.bvh"],
)  # fmt: skip
@pytest.mark.parametrize("speed", [1.3, 7.5])
def test_any_recorded_skeleton_can_walk_it(clip, speed):
    if not (MOCAP / clip).exists():
        pytest.skip(f"needs {MOCAP / clip}")
    recorded = bvh.read_bvh(MOCAP / clip, 0.05644 if "cmu10" in clip else None).motion
    for example in (None, recorded):
        motion = build_gait(speed, 3.0, FPS, recorded.skeleton, example=example)
        places, _ = forward_kinematics(motion)
        assert np.all(np.isfinite(places))
        if identify_joints(motion.skeleton).left.toe is not None:
            assert np.quantile(standing_toes(motion, speed), 0.95) < 0.02
        assert motion.root_positions[-1, 0] - motion.root_positions[0, 0] == pytest.approx(3.0 * speed, abs=0.25)
        body = identify_joints(motion.skeleton)
        middle = 0.5 * (places[:, body.left.upper_leg, 2] + places[:, body.right.upper_leg, 2])
        assert 0.9 < np.mean(middle) / measure_leg_length(motion.skeleton) < 1.25
        assert np.all(places[:, body.chest if body.neck is None else body.neck, 2] > middle)


@pytest.mark.parametrize("kind", sorted(gestures.STRIKES))
def test_the_striking_foot_is_where_the_recipe_says(kind):
    move = gestures.build_strike(kind)
    frame = int(round(move.key * move.motion.fps))
    places, _ = forward_kinematics(move.motion)
    body = identify_joints(move.motion.skeleton)
    hips = 0.5 * (places[frame, body.left.upper_leg] + places[frame, body.right.upper_leg])
    ankle = places[frame, body.right.foot] - hips
    wanted = next(row for row in gestures.STRIKES[kind].foot if row[0] == 0.0)
    assert ankle[:2] == pytest.approx(wanted[1:3], abs=0.02)
    assert places[frame, body.right.foot, 2] == pytest.approx(wanted[3], abs=0.03)
    standing = places[frame - 2 : frame + 4, body.left.toe]
    assert np.ptp(standing[:, :2], axis=0).max() < 0.01  # the other foot carries
    assert move.start < move.key < move.end


def test_kicking_is_fast():
    for kind, least in (("kick low inside", 5.0), ("kick low top", 8.0)):
        move = gestures.build_strike(kind)
        places, _ = forward_kinematics(move.motion)
        toe = places[:, identify_joints(move.motion.skeleton).right.toe]
        speed = np.linalg.norm(np.diff(toe, axis=0), axis=1) * move.motion.fps
        frame = int(round(move.key * move.motion.fps))
        assert speed[frame - 2 : frame + 2].max() > least


def test_other_moves_stay_above_the_ground_and_do_what_they_are_called():
    jump = moves.build_header()
    frame = int(round(jump.key * jump.motion.fps))
    places, _ = forward_kinematics(jump.motion)
    assert places[frame, :, 2].min() > 0.2  # both feet in the air
    up = moves.build_get_up()
    head = forward_kinematics(up.motion)[0][:, up.motion.skeleton.index("Head"), 2]
    assert head[0] < 0.3 and head[-1] > 1.5
    throw = moves.build_throw_in()
    frame = int(round(throw.key * throw.motion.fps))
    hands = forward_kinematics(throw.motion)[0][
        frame, [throw.motion.skeleton.index(f"{s}Hand") for s in ("Left", "Right")]
    ]
    assert np.all(hands[:, 2] > 1.75) and 0.08 < np.linalg.norm(hands[0] - hands[1]) < 0.45
    for move in (jump, up, throw):
        assert forward_kinematics(move.motion)[0][..., 2].min() > -0.02
