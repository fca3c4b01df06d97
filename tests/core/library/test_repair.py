"""Recordings mended on entry: planted pops, drift and sliding come out, good recordings stay as they are."""

import glob
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.files.bvh import bvh
from beyond_mocap.library import repair
from beyond_mocap.motion import contacts, quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion, forward_kinematics, resample
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.gestures import build_strike

MOCAP = Path(__file__).resolve().parents[4] / "shared/data/mocap"


@pytest.fixture(scope="module")
def walk() -> Motion:
    return build_gait(1.4, 6.0, 60.0, turn_rate=0.3, seed=2)


@pytest.mark.parametrize("width", [1, 2])
def test_planted_pops_are_taken_out(width):
    motion = build_gait(2.5, 3.0, 120.0, seed=1)
    rotations = motion.rotations.copy()
    turn = quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), 0.6)
    joint = motion.skeleton.index("LeftForeArm")
    for frame in (50, 200):
        rotations[frame : frame + width, joint] = quaternion.multiply(turn, rotations[frame : frame + width, joint])
    mended, count = repair.remove_pops(replace(motion, rotations=rotations))
    assert count == 2 * width
    turned = 2.0 * np.arccos(np.clip(np.abs(np.sum(mended.rotations * motion.rotations, axis=-1)), 0.0, 1.0))
    assert turned.max() < np.radians(1.5)


@pytest.mark.parametrize("fps", [30.0, 60.0, 120.0])
def test_fast_swings_are_no_pops(fps):
    for motion in (build_strike("kick low inside", fps=fps).motion, build_gait(9.0, 2.0, fps)):
        same, count = repair.remove_pops(motion)
        assert count == 0 and same is motion


def test_a_good_recording_only_gets_its_floor(walk):
    done = repair.repair_floor_and_feet(walk)
    assert not done.was_sliding and done.drift == 0.0 and done.travel == 0.0
    assert np.array_equal(done.motion.rotations, walk.rotations)
    assert np.ptp(done.motion.root_positions - walk.root_positions, axis=0).max() < 1e-9
    assert abs(contacts.measure_floor_height(done.motion)) < 1e-9


def knee_jerk(motion: Motion) -> float:
    """95th percentile of the third difference of both knees and ankles, m/s^3 at 30 frames per second."""
    body = identify_joints(motion.skeleton)
    joints = [joint for limb in (body.left, body.right) for joint in (limb.lower_leg, limb.foot)]
    places = forward_kinematics(resample(motion, 30.0))[0][:, joints]
    return float(np.percentile(np.linalg.norm(np.diff(places, 3, axis=0), axis=-1).max(axis=1), 95)) * 30.0**3


@pytest.mark.parametrize("speed, slid", [(0.0, True), (3.5, False), (9.0, False)])
def test_the_faster_the_run_the_more_a_foot_may_creep(speed, slid):
    motion = build_gait(max(speed, 1.2), 4.0, 120.0, seed=3)
    standing = contacts.detect_heel_toe_contacts(motion)
    seconds = np.arange(len(motion)) / motion.fps
    if speed == 0.0:  # on the spot: the travel taken away leaves feet that slide
        motion = replace(motion, root_positions=motion.root_positions - np.outer(1.0 * seconds, [1.0, 0.0, 0.0]))
    else:
        motion = replace(
            motion, root_positions=motion.root_positions + np.outer(0.04 * speed * seconds, [1.0, 0.0, 0.0])
        )
    assert repair.is_sliding(motion, standing) == slid
    done = repair.repair_floor_and_feet(motion, standing)
    assert done.was_sliding == slid and np.array_equal(done.motion.rotations, motion.rotations) != slid


@pytest.mark.parametrize("speed", [1.4, 3.0])
def test_holding_feet_on_an_uneven_floor_adds_no_jerk(speed):
    clean = build_gait(speed, 6.0, 120.0, seed=2)
    seconds = np.arange(len(clean)) / clean.fps
    bumps = 0.02 * np.sin(2.0 * np.pi * seconds / 0.9)
    off = np.column_stack([0.3 * seconds, 0.06 * np.sin(3.0 * seconds), bumps])
    sliding = replace(clean, root_positions=clean.root_positions + off)
    standing = contacts.detect_heel_toe_contacts(clean)
    done = repair.repair_floor_and_feet(sliding, standing)
    assert done.was_sliding and done.slide[1] < 0.4 * done.slide[0]
    assert knee_jerk(done.motion) < 1.1 * knee_jerk(sliding)


def test_a_drifting_floor_is_levelled(walk):
    drift = 0.15 * np.sin(np.linspace(0.0, 1.5, len(walk)))
    done = repair.repair_floor_and_feet(replace(walk, root_positions=walk.root_positions + drift[:, None]
                                                * [0.0, 0.0, 1.0]))
    assert abs(done.drift - np.ptp(drift)) < 0.03
    inside = slice(40, -40)
    off = (done.motion.root_positions - walk.root_positions)[inside, 2]
    assert np.ptp(off) < 0.025


@pytest.mark.parametrize("slope", [0.1, -0.1])
def test_a_floor_that_rises_under_a_suit_is_brought_down_before_feet_are_looked_for(slope):
    """Half a metre in five seconds."""
    level = build_gait(2.8, 5.0, 60.0)
    rising = replace(
        level, root_positions=level.root_positions + np.outer(np.arange(len(level)) / 60.0 * slope, [0, 0, 1.0])
    )
    found, drift = repair.remove_drift(rising)
    assert drift == pytest.approx(0.5, abs=0.05)
    off = (found.root_positions - level.root_positions)[:, 2]
    assert np.ptp(off[60:-60]) < 0.05 and np.ptp(off) < 0.12
    assert contacts.detect_heel_toe_contacts(found).mean() > 0.85 * contacts.detect_heel_toe_contacts(level).mean()


def test_jumps_and_level_floors_are_no_drift(walk):
    jump = np.zeros((len(walk), 3))
    at = slice(len(walk) // 2, len(walk) // 2 + 30)
    jump[at, 2] = 0.5 * np.sin(np.linspace(0.0, np.pi, 30))
    jumping = replace(walk, root_positions=walk.root_positions + jump)
    for motion in (walk, jumping):
        same, drift = repair.remove_drift(motion)
        assert same is motion and drift == 0.0


def test_sliding_feet_are_held_and_the_way_is_mended(walk):
    seconds = np.arange(len(walk)) / walk.fps
    way = np.column_stack([0.3 * seconds, 0.06 * np.sin(3.0 * seconds), 0.0 * seconds])
    standing = contacts.detect_heel_toe_contacts(walk)
    done = repair.repair_floor_and_feet(replace(walk, root_positions=walk.root_positions + way), standing)
    assert done.was_sliding and done.slide[0] > 0.25 and done.slide[1] < 0.05
    travelled = np.linalg.norm(done.motion.root_positions[-1, :2] - done.motion.root_positions[0, :2])
    asked = np.linalg.norm(walk.root_positions[-1, :2] - walk.root_positions[0, :2])
    assert abs(travelled - asked) < 0.05 * asked
    lengths = np.linalg.norm(np.diff(forward_kinematics(done.motion)[0][:, [1, 2]], axis=1), axis=-1)
    assert np.ptp(lengths) < 0.2  # two joints of the spine: the body is not torn


def test_a_motion_that_never_stands_is_left_alone(walk):
    done = repair.repair_floor_and_feet(walk, np.zeros((len(walk), 2, 2), bool))
    assert not done.was_sliding and np.array_equal(done.motion.rotations, walk.rotations)


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_the_shortest_clips_pass(walk, count):
    short, pops = repair.remove_pops(walk.frames(0, count))
    assert pops == 0
    assert len(repair.repair_floor_and_feet(short, always_plant=count > 3).motion) == count


def test_what_was_done_is_told_once_per_kind(walk):
    done = repair.repair_floor_and_feet(walk)
    mended = replace(done, drift=0.04, was_sliding=True, slide=(0.3, 0.05), travel=0.2)
    lines = repair.describe_repairs([(done, 0), (mended, 3), (mended, 0)])
    assert lines == [
        "3 single-frame jumps of joints removed from 1 clip",
        "floor levelled in 2 clips, by 4 cm (median)",
        "feet planted in 2 clips: mean slide 30 cm/s before, 5 cm/s after; path corrected by 0.20 m (median)",
    ]
    assert repair.describe_repairs([(done, 0)]) == []


def flat_slide(motion: Motion, standing: np.ndarray) -> float:
    """Mean speed in m/s of heels and toes of feet that stand flat."""
    flat = np.repeat(standing.all(axis=2)[:, :, None], 2, axis=2)
    return repair.measure_slide(motion, flat)


def mean(slides: list[tuple[float, int]]) -> float:
    """The mean over clips, each by its number of frames."""
    return sum(slide * frames for slide, frames in slides) / sum(frames for _, frames in slides)


def test_suits_slide_less_than_half_as_fast():
    files = sorted(glob.glob(str(MOCAP / "lmd/Player1/*.bvh")))[::9]
    if not files:
        pytest.skip(f"no recordings in {MOCAP / 'lmd/Player1'}")
    before, after = [], []
    for path in files:
        motion, _ = repair.remove_pops(bvh.read_bvh(path).motion)
        standing = contacts.detect_heel_toe_contacts(motion)
        done = repair.repair_floor_and_feet(motion, standing)
        frames = int(standing.all(axis=2).sum())
        before.append((flat_slide(motion, standing), frames))
        after.append((flat_slide(done.motion, standing), frames))
        feet = [identify_joints(motion.skeleton).left.foot, identify_joints(motion.skeleton).right.foot]
        assert forward_kinematics(done.motion)[0][:, feet, 2].min() > -0.02
    assert mean(before) > 0.15 and mean(after) < 0.5 * mean(before)


def without_toes(motion: Motion) -> Motion:
    """The same motion on a skeleton whose feet end in a tip where the toe joints were."""
    skeleton, body = motion.skeleton, identify_joints(motion.skeleton)
    toes = (body.left.toe, body.right.toe)
    kept = [joint for joint in range(len(skeleton)) if joint not in toes]
    new = {joint: place for place, joint in enumerate(kept)} | {-1: -1}
    ends = [(new[skeleton.parents[toe]], skeleton.offsets[toe]) for toe in toes]
    bare = replace(
        skeleton,
        names=tuple(skeleton.names[joint] for joint in kept),
        parents=tuple(new[skeleton.parents[joint]] for joint in kept),
        offsets=skeleton.offsets[kept],
        end_parents=tuple(parent for parent, _ in ends),
        end_offsets=np.array([offset for _, offset in ends]),
    )
    return replace(motion, skeleton=bare, rotations=motion.rotations[:, kept])


@pytest.mark.parametrize("plants", [False, True])
def test_boots_without_toe_joints_stand_on_the_ground_and_not_in_it(walk, plants):
    bare = without_toes(walk)
    done = repair.repair_floor_and_feet(bare, always_plant=plants).motion
    body = identify_joints(bare.skeleton)
    places, rotations = forward_kinematics(done)
    stands = contacts.detect_contacts(done)
    for side, limb in enumerate((body.left, body.right)):
        offset = bare.skeleton.end_offsets[bare.skeleton.end_parents.index(limb.foot)]
        tip = places[:, limb.foot] + quaternion.rotate(rotations[:, limb.foot], offset)
        assert abs(np.median(tip[stands[:, side], 2])) < 0.035
        assert np.median(places[stands[:, side], limb.foot, 2]) == pytest.approx(
            contacts.measure_sole_height(bare.skeleton), abs=0.02
        )
