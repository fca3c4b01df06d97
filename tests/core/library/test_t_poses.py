"""T-poses at the start and the end of recordings are left out; level arms in the middle, or while moving, stay."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.annotation import ClipAnnotation
from beyond_mocap.base.errors import InputError
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.library.listing import list_clips
from beyond_mocap.library.proposals import propose_labels
from beyond_mocap.library.repair import TPoses
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion, concatenate_motions
from beyond_mocap.motion.t_poses import find_t_poses
from beyond_mocap.synthesis.search.candidate_index import CandidateIndex
from beyond_mocap.synthetic.gait import build_gait

FPS = 30.0


def spread_arms(motion: Motion, degrees: np.ndarray | float = 90.0) -> Motion:
    """The same with legs and trunk at rest, and straight arms that are raised sideways by degrees (T,) or one."""
    body, rotations = identify_joints(motion.skeleton), motion.rotations.copy()
    rotations[:, 1:] = (1.0, 0.0, 0.0, 0.0)
    for limb, side in ((body.left, 1.0), (body.right, -1.0)):
        angle = np.broadcast_to(side * np.radians(degrees), len(motion))
        rotations[:, limb.upper_arm] = quaternion.from_axis_angle(np.tile([1.0, 0.0, 0.0], (len(motion), 1)), angle)
    return Motion(motion.skeleton, motion.root_positions, rotations, motion.fps)


def hold(motion: Motion, frame: int, seconds: float) -> Motion:
    """One frame for some seconds."""
    which = np.full(round(seconds * motion.fps), frame)
    return Motion(motion.skeleton, motion.root_positions[which], motion.rotations[which], motion.fps)


def join(*motions: Motion) -> Motion:
    return concatenate_motions(list(motions))


@pytest.fixture(scope="module")
def walk():
    return build_gait(1.2, 3.0, FPS, seed=1)


@pytest.mark.parametrize("seconds, degrees", [(1.0, 90.0), (0.3, 100.0), (1.0, 45.0), (1.0 / FPS, 90.0)])
def test_it_is_found_at_both_ends_with_the_jump_out_of_it(walk, seconds, degrees):
    first, last = (spread_arms(hold(walk, frame, seconds), degrees) for frame in (0, -1))
    frames = round(seconds * FPS)
    assert find_t_poses(join(first, walk)) == (frames, 0)
    assert find_t_poses(join(walk, last)) == (0, frames)
    assert find_t_poses(join(first, walk, last)) == (frames, frames)


def test_the_arms_are_lowered_with_it(walk):
    lowering = spread_arms(hold(walk, 0, 1.0), np.linspace(90.0, 5.0, 30))
    start, end = find_t_poses(join(spread_arms(hold(walk, 0, 1.0)), lowering, walk))
    assert end == 0 and start == pytest.approx(30 + 30 * 60 / 85, abs=2)


def test_hands_that_shake_at_its_limits_do_not_end_it(walk):
    shaking = spread_arms(hold(walk, 0, 3.0), 103.0 + np.random.default_rng(0).normal(0.0, 3.0, 90))
    assert find_t_poses(join(spread_arms(hold(walk, 0, 0.5)), shaking, walk)) == (105, 0)


def test_a_recording_of_nothing_else_is_left_out(walk):
    calibration = spread_arms(hold(walk, 0, 2.0))
    assert find_t_poses(calibration) == (len(calibration), 0)


@pytest.mark.parametrize("name", ["walk", "arms hang", "in the middle", "while walking", "in the air"])
def test_other_motion_stays(walk, name):
    stand, spread = spread_arms(hold(walk, 0, 1.0), 8.0), spread_arms(hold(walk, 0, 1.0))
    raised = spread_arms(hold(walk, 0, 1.0), 150.0)
    motion = {"walk": walk, "arms hang": stand, "in the middle": join(stand, spread, walk),
              "while walking": spread_arms(walk), "in the air": raised}[name]
    assert find_t_poses(motion) == (0, 0)


def test_the_jump_out_of_it_is_no_kick():
    walk = build_gait(1.2, 2.0, 4.0 * FPS, seed=1)
    step = walk.frames(20, len(walk))
    motion = join(spread_arms(hold(step, 0, 1.0)), step)
    rows = [[(one.annotation.start + shift, one.annotation.end + shift, one.annotation.words) for one in proposals]
            for proposals, shift in ((propose_labels(motion), 0), (propose_labels(step), 120))]
    assert rows[0] == rows[1]
    assert any("kick" in one.annotation.words for one in propose_labels(motion, t_pose_frames=(0, 0)))


def test_an_act_that_a_person_names_there_stays(walk):
    motion = join(spread_arms(hold(walk, 0, 1.0)), walk)
    for words, frames in ((("celebration",), (0, 0)), (("standing",), (30, 0))):
        t_poses = TPoses()
        t_poses.add_recording(Path("clip.bvh"), motion, lambda words=words: [ClipAnnotation(0, 29, None, words)])
        assert t_poses.frames == [frames]


def test_an_act_at_one_end_keeps_that_end_only(walk):
    motion = join(spread_arms(hold(walk, 0, 1.0)), walk, spread_arms(hold(walk, len(walk) - 1, 1.0)))
    t_poses = TPoses()
    t_poses.add_recording(Path("clip.bvh"), motion, lambda: [
        ClipAnnotation(0, 29, None, ("standing", "calm")),
        ClipAnnotation(len(motion) - 30, len(motion) - 1, None, ("celebration",))])
    assert t_poses.frames == [(30, 0)]


def test_a_short_clip_that_moves_is_no_t_pose(walk):
    motion = spread_arms(walk.frames(0, 5))
    moved = motion.root_positions + np.outer(np.arange(5) / FPS, (4.0, 0.0, 0.0))
    assert find_t_poses(replace(motion, root_positions=moved)) == (0, 0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Walks with a T-pose before them, labelled throughout, one of them with a key moment, and a calibration."""
    folder = tmp_path_factory.mktemp("calibrated")
    for number, speed in enumerate((1.1, 1.2, 1.3)):
        walk = build_gait(speed, 6.0, FPS, seed=number)
        bvh.write_bvh(folder / f"walk{number}.bvh", join(spread_arms(hold(walk, 0, 1.5)), walk))
        (folder / f"walk{number}.txt").write_text("0 7.4 walking\n" + "3 kick right\n" * (number == 0))
    bvh.write_bvh(folder / "calibration.bvh", spread_arms(hold(walk, 0, 2.0)))
    (folder / "calibration.txt").write_text("0 1.9 standing\n")
    return folder


@pytest.fixture(scope="module")
def library(folder):
    return build_library(folder)


def test_a_library_tells_what_is_left_out(library):
    assert {"3 clips: T-pose at the start left out, 1.5 s (median)",
            "1 clip left out: nothing but a T-pose"} <= set(library.notes)
    assert library.unlabelled_notes == ()  # a label would not help the calibration
    assert "T-pose left out: 1.5 s" in next(one for one in list_clips(library) if one.path == "walk1.bvh").details


def test_times_are_those_of_the_file(folder, library):
    clip = next(clip for clip in library.clips if clip.path == "walk0.bvh" and not clip.mirrored)
    row, key = sorted(clip.annotations, key=lambda one: one.key is not None)
    assert len(clip.motion) == len(bvh.read_bvh(folder / clip.path).motion)
    assert row.start == pytest.approx(45 + 0.35 * FPS, abs=1) and row.end == pytest.approx(7.4 * FPS, abs=1)
    assert key.key == pytest.approx(3.0 * FPS)
    first = library.frames.first[library.clips.index(clip)]
    assert np.ptp(library.frames.root[first : first + 45, :2], axis=0) == pytest.approx(0.0, abs=1e-6)


def test_nothing_plays_it_or_learns_from_it(library):
    frames, is_left = library.frames, library.shows_t_pose
    seconds = frames.source / FPS
    calibrations = [i for i, clip in enumerate(library.clips) if clip.path == "calibration.bvh"]
    assert np.array_equal(is_left, (seconds < 1.85) | np.isin(frames.clip, calibrations))
    assert not frames.words[is_left].any() and library.strangeness[is_left].min() > 5.0
    assert not CandidateIndex.for_library(library, np.ones(len(library.clips), bool)).valid[:, is_left].any()
    assert not library.coverage.has_stand
    assert np.mean(library.strangeness[~is_left] > 1.0) < 0.05


def test_the_cache_knows_it(folder, library):
    again = build_library(folder)
    assert [clip.t_pose_frames for clip in again.clips] == [clip.t_pose_frames for clip in library.clips]
    assert np.array_equal(again.shows_t_pose, library.shows_t_pose)


def test_a_folder_of_calibrations_is_refused(tmp_path, walk):
    bvh.write_bvh(tmp_path / "calibration.bvh", spread_arms(hold(walk, 0, 2.0)))
    (tmp_path / "calibration.txt").write_text("0 1.9 walking\n")
    with pytest.raises(InputError, match="nothing but T-poses"):
        build_library(tmp_path)
