"""A folder of clips becomes a library: what is planted in it comes out, and what is wrong is told in one line."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError, UserCancelledError
from beyond_mocap.cli.library import summarize_library
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.library.features import build_label_matrix
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion, forward_kinematics
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.gestures import build_strike

CSV = "file,start_frame,end_frame,key_frame,labels\n"


def clip_of(library, path, mirrored=False):
    return next(clip for clip in library.clips if (clip.path, clip.mirrored) == (path, mirrored))


def one_line(error: pytest.ExceptionInfo) -> str:
    assert "\n" not in str(error.value)
    return str(error.value)


def test_every_clip_stands_beside_its_mirror(library):
    paths = ["bows/turn.bvh", "jog.bvh", "kick.bvh", "run.bvh", "stand.bvh", "walk.bvh"]
    assert [(clip.path, clip.mirrored) for clip in library.clips] == [(p, m) for p in paths for m in (False, True)]


def test_the_mirror_has_words_contacts_and_travel_of_the_other_side(library):
    for clip, twin in zip(library.clips[::2], library.clips[1::2]):
        assert np.array_equal(clip.heel_toe_contacts, twin.heel_toe_contacts[:, ::-1])
        assert np.allclose(clip.motion.root_positions * [1, -1, 1], twin.motion.root_positions, atol=1e-9)
    assert clip_of(library, "bows/turn.bvh", True).annotations[0].words == ("walking", "right")
    assert clip_of(library, "kick.bvh", True).labels_at(156) == {"kick", "low", "inside", "left"}


def test_clips_stand_on_the_floor(library):
    for clip in library.clips:
        body = identify_joints(clip.motion.skeleton)
        toes = forward_kinematics(clip.motion)[0][:, [body.left.toe_or_foot, body.right.toe_or_foot], 2]
        assert abs(np.percentile(toes, 2)) < 1e-6


def test_a_clip_that_floats_is_brought_down(tmp_path, clip_file):
    motion = build_gait(1.4, 2.0)
    for name, height in (("low", 0.0), ("high", 0.7)):
        clip_file(tmp_path / f"{name}.bvh")
        bvh.write_bvh(
            tmp_path / f"{name}.bvh",
            Motion(motion.skeleton, motion.root_positions + [0, 0, height], motion.rotations, 30.0),
        )
    library = build_library(tmp_path, unit=0.01)
    high, low = clip_of(library, "high.bvh"), clip_of(library, "low.bvh")
    assert np.allclose(high.motion.root_positions, low.motion.root_positions, atol=1e-6)


def test_gaits_have_the_planted_speeds(library):
    assert [gait.label for gait in library.gaits] == ["standing", "walking", "jogging", "running"]
    assert np.allclose([gait.speed for gait in library.gaits], [0.0, 1.4, 2.8, 5.0], atol=0.05)


def test_frames_say_where_they_come_from(library):
    frames = library.frames
    assert np.array_equal(frames.first, np.cumsum(frames.count) - frames.count)
    assert np.array_equal(frames.clip, np.repeat(np.arange(len(library.clips)), frames.count))
    for number, clip in enumerate(library.clips):
        source = frames.source[frames.first[number] :][: frames.count[number]]
        assert np.allclose(source, np.arange(len(source)) * clip.motion.fps / 30.0)
        assert source[-1] <= len(clip.motion) - 1 < source[-1] + clip.motion.fps / 30.0
        assert np.allclose(
            frames.root[frames.clip == number], clip.motion.root_positions[source.astype(int)], atol=1e-9
        )
    assert frames.remaining_in_clip[frames.first].tolist() == (frames.count - 1).tolist()


def test_words_of_frames_are_those_of_the_clip(library):
    for number, clip in enumerate(library.clips):
        here = library.frames.clip == number
        for source, row in zip(library.frames.source[here], library.frames.words[here]):
            assert frozenset(np.array(library.frames.vocabulary)[row]) == clip.labels_at(source)
    assert np.array_equal(build_label_matrix(library.clips[0], np.array([1e9]), ("walking", "left")), [[False, False]])


def test_the_planted_kick_is_found_on_both_sides(library, kick_seconds):
    assert [(library.clips[key.clip].path, library.clips[key.clip].mirrored) for key in library.keys] == [
        ("kick.bvh", False), ("kick.bvh", True),
    ]  # fmt: skip
    for key, side in zip(library.keys, ("right", "left")):
        assert abs(key.frame / 60.0 - kick_seconds) < 0.5 / 60.0
        assert key.start < key.frame < key.end
        assert key.labels == {"kick", "low", "inside", side}


def test_speeds_and_turning_of_the_frames(library):
    frames = library.frames
    planted = (("run.bvh", False, 5.0, 0.0), ("bows/turn.bvh", False, 1.4, 0.9), ("bows/turn.bvh", True, 1.4, -0.9))
    for path, mirrored, speed, turn in planted:
        number = library.clips.index(clip_of(library, path, mirrored))
        inside = np.flatnonzero(frames.clip == number)[20:-20]
        assert np.allclose(frames.speed[inside], speed, atol=0.12)
        rate = (frames.heading[inside[-1]] - frames.heading[inside[0]]) / (len(inside) - 1) * 30.0
        assert abs(rate - turn) < 0.1  # not whole strides: the pelvis twists
        assert np.allclose(frames.velocity[inside].mean(axis=0), [speed, 0.0], atol=0.12)


def test_minutes_do_not_count_the_mirrors(library):
    assert library.minutes == pytest.approx((4 * 5 + 4 + 288 / 60) / 60, abs=1e-3)


def test_one_clip_is_a_library(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh", 1.4, 2.0)
    library = build_library(tmp_path)
    assert len(library.clips) == 2 and [gait.label for gait in library.gaits] == ["walking"]


def test_a_clip_of_one_frame_is_kept(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh", 1.4, 1.0)
    motion = build_gait(1.4, 1.0)
    bvh.write_bvh(tmp_path / "still.bvh", Motion(motion.skeleton, motion.root_positions[:1], motion.rotations[:1],
                                                 30.0))
    library = build_library(tmp_path)
    assert library.frames.count.tolist() == [1, 1, 31, 31]
    assert np.all(np.isfinite(library.frames.features))


def scaled(skeleton: Skeleton, factor: float) -> Skeleton:
    return Skeleton(
        skeleton.names, skeleton.parents, skeleton.offsets * factor, skeleton.end_parents, skeleton.end_offsets
    )


def test_clips_of_different_skeletons_are_retargeted(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh", 1.4, 2.0)
    motion = build_gait(1.4, 1.0)
    clip_file(tmp_path / "child.bvh", 1.4, 1.0)
    small = Motion(scaled(motion.skeleton, 0.7), motion.root_positions * 0.7, motion.rotations, 30.0)
    bvh.write_bvh(tmp_path / "child.bvh", small)
    library = build_library(tmp_path, unit=0.01)
    assert all(clip.motion.skeleton is library.skeleton for clip in library.clips)
    bvh.write_bvh(tmp_path / "child.bvh.full", motion)
    full = bvh.read_bvh(tmp_path / "child.bvh.full", 0.01).motion
    assert np.allclose(library.skeleton.offsets, full.skeleton.offsets, atol=1e-4)
    child = clip_of(library, "child.bvh")
    places, wanted = forward_kinematics(child.motion)[0], forward_kinematics(full)[0]
    level = np.mean(places[..., 2] - wanted[..., 2])  # each stands on its own floor
    off = np.linalg.norm(places - wanted - [0.0, 0.0, level], axis=-1)
    assert off.mean() < 0.03 and off.max() < 0.1  # its second of walking shows another mean posture than the walk does
    assert any("1 clip of 1 other skeleton retargeted to the one with" in note for note in library.notes)
    small_too = build_library(tmp_path, unit=0.01, skeleton=tmp_path / "child.bvh")
    assert np.allclose(small_too.skeleton.offsets, 0.7 * full.skeleton.offsets, atol=1e-4)
    assert [clip.path for clip in small_too.clips] == [clip.path for clip in library.clips]


def test_a_clip_without_legs_is_told_with_its_file(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh", 1.4, 2.0)
    stick = Skeleton(("root", "top"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    bvh.write_bvh(tmp_path / "stick.bvh", Motion(stick, np.zeros((4, 3)), np.tile((1.0, 0.0, 0.0, 0.0), (4, 2, 1)),
                                                 30.0))
    with pytest.raises(InputError, match=r"stick\.bvh.*no joint found for left upper_leg") as told:
        build_library(tmp_path)
    one_line(told)


def test_bones_that_differ_by_rounding_are_one_skeleton(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh", 1.4, 2.0)
    motion = build_gait(1.4, 1.0)
    clip_file(tmp_path / "same.bvh", 1.4, 1.0)
    bvh.write_bvh(
        tmp_path / "same.bvh", Motion(scaled(motion.skeleton, 1.001), motion.root_positions, motion.rotations, 30.0)
    )
    library = build_library(tmp_path, unit=0.01)
    assert {id(clip.motion.skeleton) for clip in library.clips} == {id(library.skeleton)}
    walk = bvh.read_bvh(tmp_path / "walk.bvh", 0.01).motion.skeleton
    assert np.array_equal(library.skeleton.offsets, walk.offsets)  # of the clip with most frames


def test_without_locomotion_the_library_stands_but_has_no_gaits(tmp_path, clip_file):
    clip_file(tmp_path / "stand.bvh", 0.0, 2.0, "standing")
    library = build_library(tmp_path)
    with pytest.raises(InputError, match="no locomotion clip.*walking") as told:
        library.gaits
    assert str(tmp_path) in one_line(told)


def test_walking_that_is_no_faster_than_standing_is_no_locomotion(tmp_path, clip_file):
    clip_file(tmp_path / "stand.bvh", 0.3, 3.0, "standing")
    clip_file(tmp_path / "walk.bvh", 0.0, 3.0)
    with pytest.raises(InputError, match="no locomotion clip that is faster than its stands.*walking") as told:
        build_library(tmp_path).with_synthetic_clips
    assert str(tmp_path) in one_line(told)


def test_without_annotations_labels_are_proposed_and_marked(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh", words="")
    clip_file(tmp_path / "run.bvh", 4.5, 4.0, words="")
    bvh.write_bvh(tmp_path / "kick.bvh", build_strike("kick low top", fps=60.0).motion)
    for _ in range(2):  # built, then from the cache
        library = build_library(tmp_path)
        assert all(clip.has_proposed_labels for clip in library.clips)
        assert {"walking", "running"} <= {gait.label for gait in library.gaits}
        key, = [key for key in library.keys if not library.clips[key.clip].mirrored]
        assert {"kick", "right"} <= key.labels
        note, = library.proposal_notes
        assert note.startswith("labels proposed for 3 clips") and "\n" not in note


def test_proposals_stop_with_the_first_annotation(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh")
    clip_file(tmp_path / "silent.bvh", 1.0, 2.0, "")
    library = build_library(tmp_path)
    assert library.proposal_notes == () and clip_of(library, "silent.bvh").annotations == ()


def test_clips_without_labels_are_named_where_others_have_some(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh")
    assert build_library(tmp_path).unlabelled_notes == ()
    clip_file(tmp_path / "runs" / "fast.bvh", 4.0, 2.0, "")
    library = build_library(tmp_path)
    line, = library.unlabelled_notes
    assert line.startswith("1 clip has no labels and is not used: runs/fast.bvh; label ")
    assert line in summarize_library(library)["lines"]
    more = tuple(replace(clip_of(library, "runs/fast.bvh"), path=f"{number}.bvh") for number in range(5))
    line, = replace(library, clips=more).unlabelled_notes
    assert line.startswith("5 clips have no labels and are not used: 0.bvh, 1.bvh, 2.bvh and 2 more; label ")


def test_rows_beyond_the_clip_are_cut_or_told(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh", 1.4, 2.0)
    (tmp_path / "walk.txt").write_text("0 99 walking\n")
    assert clip_of(build_library(tmp_path), "walk.bvh").annotations[0].end == 60
    (tmp_path / "walk.txt").write_text("0 2 walking\n2.5 3 jogging\n")
    with pytest.raises(InputError, match=r"walk.*frame 75.*0 to 60") as told:
        build_library(tmp_path)
    one_line(told)


def test_a_key_moment_beyond_the_clip_is_told(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh", 1.4, 2.0, "")
    (tmp_path / "walk.txt").unlink()
    (tmp_path / "annotations.csv").write_text(CSV + "walk.bvh,0,60,,walking\nwalk.bvh,30,99,80,kick right\n")
    with pytest.raises(InputError, match=r"annotations.csv:3: .* 80; expected frames 0 to 60 of walk") as told:
        build_library(tmp_path)
    one_line(told)


@pytest.mark.parametrize("text", ["0 1 walking\nrubbish\n", "5 1 walking\n", "1 2 3 walking\n"])
def test_a_broken_annotation_is_told_with_file_and_line(tmp_path, clip_file, text):
    clip_file(tmp_path / "walk.bvh")
    (tmp_path / "walk.txt").write_text(text)
    with pytest.raises(InputError, match=r"walk\.txt:[12]: ") as told:
        build_library(tmp_path)
    one_line(told)


def test_a_link_that_leads_nowhere_is_told(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh")
    (tmp_path / "gone.bvh").symlink_to(tmp_path / "nowhere.bvh")
    with pytest.raises(InputError, match=r"gone\.bvh") as told:
        build_library(tmp_path)
    one_line(told)


def test_building_can_be_stopped(clips_folder, tmp_path):
    calls = []
    with pytest.raises(UserCancelledError):
        build_library(clips_folder, rebuild=True, cache_dir=tmp_path, cancelled=lambda: len(calls) > 4
                      or calls.append(1))
    assert list(tmp_path.iterdir()) == []


def test_progress_never_goes_back(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh")
    told = []
    build_library(tmp_path, progress=lambda fraction, text: told.append(fraction))
    assert told == sorted(told) and told[-1] == 1.0
