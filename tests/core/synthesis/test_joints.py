"""Seams moved to where two clips agree best, every other frame left where it is."""

import numpy as np
import pytest

from beyond_mocap.synthesis.search.distance import MAX_TRANSITION_SHIFT, build_edit_list
from beyond_mocap.synthesis.search.edit_list import find_transitions

SEEDS = range(40)


def joined(library, random, most=6):
    """Clips and library frames of one to `most` pieces of any clips, each inside its clip."""
    clip, frame = [], []
    for _ in range(random.integers(1, most + 1)):
        number, length = random.integers(len(library.clips)), random.integers(2, 30)
        start = library.frames.first[number] + random.integers(0, library.frames.count[number] - length + 1)
        clip.append(np.full(length, number))
        frame.append(start + np.arange(length))
    return np.concatenate(clip), np.concatenate(frame).astype(float)


@pytest.mark.parametrize("seed", SEEDS)
def test_nothing_but_the_seams_moves(library, seed):
    random = np.random.default_rng(seed)
    clip, frame = joined(library, random)
    fixed = [at for at in random.integers(0, 60, random.integers(4)).tolist() if at < len(clip)]
    before = find_transitions(clip, frame)
    edit = build_edit_list(library, clip, frame, (), fixed)
    assert len(edit) == len(clip)
    assert np.array_equal(edit.clip[fixed], clip[fixed]) and np.array_equal(edit.frame[fixed], frame[fixed])
    changed = np.flatnonzero((edit.clip != clip) | (edit.frame != frame))
    assert all(np.min(np.abs(before - at)) <= MAX_TRANSITION_SHIFT for at in changed)
    first, end = library.frames.first[edit.clip], (library.frames.first + library.frames.count)[edit.clip]
    assert np.all((edit.frame >= first) & (edit.frame < end))


def test_some_seams_do_move(library):
    moved = 0
    for seed in SEEDS:
        clip, frame = joined(library, np.random.default_rng(seed))
        moved += not np.array_equal(build_edit_list(library, clip, frame, (), []).frame, frame)
    assert moved > len(SEEDS) / 2


@pytest.mark.parametrize("seed", SEEDS)
def test_no_seam_gets_worse(library, seed):
    clip, frame = joined(library, np.random.default_rng(100 + seed), most=2)
    edit = build_edit_list(library, clip, frame, (), [])
    assert gap(library, edit.clip, edit.frame) <= gap(library, clip, frame) + 1e-6


def gap(library, clip, frame):
    """The largest distance between the frame that would follow and the one that does; inf where the clip is over."""
    features, worst = library.frames.features, 0.0
    for seam in find_transitions(clip, frame):
        number = clip[seam - 1]
        follow = int(frame[seam - 1]) + 1
        if follow == library.frames.first[number] + library.frames.count[number]:
            return np.inf
        worst = max(worst, float(np.linalg.norm(features[follow] - features[int(frame[seam])])))
    return worst


def test_a_cut_that_was_made_two_frames_too_late_is_found(library):
    """Two halves of one walk, the first held two frames too long: the seam goes where going on costs least."""
    first = float(library.frames.first[10])
    frame = np.concatenate([first + 20 + np.arange(12), first + 32 + np.arange(12)])
    clip = np.full(24, 10)
    assert len(build_edit_list(library, clip, frame, (), []).transitions) == 0
    other = np.concatenate([np.full(12, 6), np.full(12, 10)])
    moved = np.concatenate([library.frames.first[6] + 40.0 + np.arange(12), frame[12:]])
    edit = build_edit_list(library, other, moved, (), [])
    assert len(edit.transitions) == 1 and abs(int(edit.transitions[0]) - 12) <= MAX_TRANSITION_SHIFT


def test_the_input_is_left_alone(library):
    clip, frame = joined(library, np.random.default_rng(5))
    kept = clip.copy(), frame.copy()
    build_edit_list(library, clip, frame, (), [])
    assert np.array_equal(clip, kept[0]) and np.array_equal(frame, kept[1])
