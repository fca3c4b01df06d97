"""Edit lists at other rates, and the frames that they stand for."""

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.motion.motion import sample_frames
from beyond_mocap.synthesis.search.edit_list import EditList, find_transitions, sample_edit
from beyond_mocap.synthesis.search.source_frames import fetch_motion

CLIP = np.array([2, 2, 2, 2, 5, 5, 5, 2, 2, 2])
FRAME = np.array([10.0, 11, 12, 13, 70, 71, 72, 14, 15, 16])


def edit_of(clip=CLIP, frame=FRAME):
    return EditList(clip, frame, find_transitions(clip, frame), ())


def test_seams_are_cuts_jumps_and_steps_back():
    assert find_transitions(CLIP, FRAME).tolist() == [4, 7]
    same = np.zeros(8, int)
    assert find_transitions(same, np.array([0, 1, 2, 4, 5, 5, 6, 5.5])).tolist() == [3, 7]
    assert find_transitions(same, 1.45 * np.arange(8)).tolist() == find_transitions(same,
                                                                                    0.0 * np.arange(8)).tolist() == []
    assert edit_of().pieces == [(0, 4), (4, 7), (7, 10)]


def test_whole_frames_come_back_as_they_are():
    clip, frame, piece = sample_edit(edit_of(), np.arange(10.0))
    assert np.array_equal(clip, CLIP) and np.allclose(frame, FRAME) and piece.tolist() == [0] * 4 + [1] * 3 + [2] * 3


@pytest.mark.parametrize("fps", [24.0, 25.0, 29.97, 50.0, 60.0, 120.0])
def test_pieces_are_never_mixed(fps):
    index = np.arange(0.0, 9.0, 30.0 / fps)
    clip, frame, piece = sample_edit(edit_of(), index)
    for number, offset in ((0, 10), (1, 66), (2, 7)):
        inside = piece == number
        assert np.all(clip[inside] == CLIP[[0, 4, 7][number]])
        assert np.allclose(frame[inside], index[inside] + offset)


def test_between_a_piece_s_last_frame_and_the_seam_it_goes_on():
    _, frame, piece = sample_edit(edit_of(), np.array([3.0, 3.5, 3.99, 4.0]))
    assert np.allclose(frame, [13.0, 13.5, 13.99, 70.0]) and piece.tolist() == [0, 0, 0, 1]


def test_a_piece_of_one_frame():
    clip, frame, _ = sample_edit(
        edit_of(np.array([1, 2, 1]), np.array([5.0, 90.0, 30.0])), np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    )
    assert clip.tolist() == [1, 1, 2, 2, 1] and np.allclose(frame, [5, 5.5, 90, 90.5, 30])


@pytest.fixture(scope="module")
def straight(library):
    """Three seconds of the bow that turns left (60 fps), uncut, from its tenth library frame on."""
    number = next(i for i, c in enumerate(library.clips) if c.path == "bows/turn.bvh" and not c.mirrored)
    frame = library.frames.first[number] + 10.0 + np.arange(91)
    return number, EditList(np.full(91, number), frame, np.zeros(0, int), ())


@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0])
def test_footage_laid_back_is_the_recording(library, straight, fps):
    number, edit = straight
    source = library.clips[number].motion
    index = np.arange(0.0, 90.0, 30.0 / fps)
    footage = fetch_motion(library, edit, index, fps)
    own = (10.0 + index) * 2.0
    root, rotations = sample_frames(source, own)
    heading = np.interp(10.0 + index, np.arange(200), library.frames.heading[library.frames.first[number] :][:200])
    path = np.stack(
        [
            np.interp(10.0 + index, np.arange(121), library.frames.path[library.frames.clip == number][:, a])
            for a in (0, 1)
        ],
        1,
    )
    pose = footage.pose.copy()
    pose[:, 0] = quaternion.multiply(quaternion.from_up_angle(heading), pose[:, 0])
    assert np.allclose(np.abs(np.sum(pose * rotations, axis=-1)), 1.0, atol=1e-9)
    sway = quaternion.rotate(quaternion.from_up_angle(heading), np.pad(footage.sway, ((0, 0), (0, 1))))[:, :2]
    assert np.allclose(path + sway, root[:, :2], atol=1e-9) and np.allclose(footage.height, root[:, 2], atol=1e-9)
    assert np.allclose(footage.clip_frame, own, atol=1e-9)
    assert np.array_equal(footage.heel_toe_contacts, library.clips[number].heel_toe_contacts[np.round(own).astype(int)])


@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0])
def test_speed_and_turning_of_footage_do_not_depend_on_the_rate(library, straight, fps):
    footage = fetch_motion(library, straight[1], np.arange(0.0, 90.0, 30.0 / fps), fps)
    assert np.allclose(footage.velocity.mean(axis=0), [1.4, 0.0], atol=0.1)
    assert footage.turn[0] == 0.0 and footage.turn[1:].mean() * fps == pytest.approx(0.9, abs=0.1)
    assert len(footage.transitions) == 0


def test_played_faster_it_goes_faster(library, straight):
    number, edit = straight
    quick = EditList(edit.clip[:60], edit.frame[0] + 1.2 * np.arange(60), edit.transitions, ())
    slow, fast = (fetch_motion(library, e, np.arange(60.0), 30.0).velocity[:, 0] for e in (edit, quick))
    assert fast.mean() == pytest.approx(1.2 * slow.mean(), rel=0.03)


def test_at_a_seam_it_is_known_what_would_have_come_next(library):
    first = library.frames.first
    clip, frame = (
        np.repeat([4, 6], 20),
        np.concatenate([first[4] + 30.0 + np.arange(20), first[6] + 60.0 + np.arange(20)]),
    )
    footage = fetch_motion(library, EditList(clip, frame, find_transitions(clip, frame), ()), np.arange(40.0), 30.0)
    going_on = EditList(clip[:21] * 0 + 4, first[4] + 30.0 + np.arange(21), np.zeros(0, int), ())
    uncut = fetch_motion(library, going_on, np.arange(21.0), 30.0)
    assert footage.transitions.tolist() == [20] and footage.turn[20] == 0.0
    assert np.allclose(np.abs(np.sum(footage.ahead_pose[0] * uncut.pose[20], axis=-1)), 1.0, atol=1e-9)
    assert footage.ahead_height[0] == pytest.approx(uncut.height[20]) and np.allclose(
        footage.ahead_sway[0], uncut.sway[20]
    )
    assert np.allclose(footage.velocity[19], uncut.velocity[19])


def test_beyond_a_clip_its_end_is_held(library):
    last = library.frames.first[4] + library.frames.count[4] - 1
    edit = EditList(np.full(10, 4), last - 4.0 + np.arange(10), np.zeros(0, int), ())
    footage = fetch_motion(library, edit, np.arange(10.0), 30.0)
    assert np.allclose(footage.pose[4:], footage.pose[4]) and np.all(np.isfinite(footage.pose))
    assert footage.clip_frame.max() == len(library.clips[4].motion) - 1


def test_one_frame(library):
    footage = fetch_motion(
        library,
        EditList(np.array([4]), np.array([float(library.frames.first[4])]), np.zeros(0, int), ()),
        np.zeros(1),
        30.0,
    )
    assert len(footage.clip) == 1 and np.all(np.isfinite(footage.velocity)) and footage.turn.tolist() == [0.0]
