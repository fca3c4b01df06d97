"""What lies beyond a seam: the frames that the pieces on both sides would go on to show."""

import numpy as np

from beyond_mocap.motion.motion import sample_frames
from beyond_mocap.synthesis.search.edit_list import EditList, find_transitions
from beyond_mocap.synthesis.search.source_frames import fetch_motion, fetch_overlap


def footage(library, lengths, starts, clips):
    """Pieces of `clips`, each `lengths` frames long, from its clip's frame `starts` on."""
    clip = np.repeat(clips, lengths)
    first = library.frames.first
    frame = np.concatenate([first[c] + s + np.arange(float(n)) for c, s, n in zip(clips, starts, lengths)])
    edit = EditList(clip, frame, find_transitions(clip, frame), ())
    return fetch_motion(library, edit, np.arange(float(len(clip))), library.fps)


def shown_elsewhere(library, clip, frame):
    """Local rotations (J - 1, 4) of the joints below the root at a library frame."""
    motion = library.clips[clip].motion
    source = (frame - library.frames.first[clip]) * motion.fps / library.fps
    return sample_frames(motion, np.array([source]))[1][0, 1:]


def test_the_other_piece_goes_on_behind_the_seam_and_began_before_it(library):
    played = footage(library, (20, 20), (4, 15), (0, 1))
    over = fetch_overlap(library, played, 6.0)
    first = library.frames.first
    assert over.at.tolist() == list(range(14, 26)) and over.after.tolist() == [False] * 6 + [True] * 6
    assert np.all(np.diff(over.through) > 0) and 0.0 < over.through[0] and over.through[-1] < 1.0
    for row, at in enumerate(over.at):
        clip, frame = (0, first[0] + 4 + at) if at >= 20 else (1, first[1] + 15 - 20 + at)
        same = np.abs(np.sum(over.pose[row, 1:] * shown_elsewhere(library, clip, frame), axis=-1))
        assert np.allclose(same, 1.0, atol=1e-9)


def test_windows_end_in_the_middle_of_a_short_piece(library):
    over = fetch_overlap(library, footage(library, (20, 7, 20), (4, 20, 15), (0, 1, 0)), 6.0)
    assert len(np.unique(over.at)) == len(over.at)
    assert over.at.tolist() == list(range(14, 23)) + list(range(24, 33))


def test_a_clip_that_ends_at_the_seam_is_held_for_two_frames(library):
    last = int(library.frames.count[0])
    over = fetch_overlap(library, footage(library, (20, 20), (last - 20, 0), (0, 1)), 6.0)
    assert over.at.tolist() == [18, 19, 20, 21]
    assert np.array_equal(over.pose[2], over.pose[3]) and np.array_equal(over.pose[0], over.pose[1])


def test_one_piece_has_nothing_beyond(library):
    over = fetch_overlap(library, footage(library, (30,), (2,), (0,)), 6.0)
    assert len(over.at) == 0 and over.pose.shape == (0, len(library.skeleton), 4)
