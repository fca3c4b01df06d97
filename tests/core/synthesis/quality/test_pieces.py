"""Seams, warp and loops read off a provenance whose pieces are known."""

import numpy as np
import pytest

from beyond_mocap.synthesis.quality.playback import find_replayed, find_transitions, list_warp_rates

FPS = 30.0


def provenance(*parts, stride=4.0):
    """clip, mirrored, clip_frame, stride (T,) of parts (clip, first source frame, frames, rate)."""
    clip = np.concatenate([np.full(count, number) for number, _, count, _ in parts])
    frames = np.concatenate([first + np.arange(count) * stride * rate for _, first, count, rate in parts])
    return clip, np.zeros(len(clip), bool), frames, np.full(len(clip), stride)


def test_one_clip_played_through_has_no_seam():
    source = provenance((0, 100.0, 90, 1.0))
    assert len(find_transitions(*source)) == 0
    np.testing.assert_allclose(list_warp_rates(*source), 1.0)
    assert not find_replayed(*source, FPS).any()


@pytest.mark.parametrize("rate", [0.85, 1.0, 1.2, 2.5])
def test_a_steady_warp_is_no_seam_and_is_told(rate):
    source = provenance((0, 0.0, 60, rate))
    assert len(find_transitions(*source)) == 0
    np.testing.assert_allclose(list_warp_rates(*source), rate)


def test_a_planted_warp_of_1_2_is_the_maximum():
    rate = np.concatenate([np.ones(30), np.full(30, 1.2), np.full(30, 0.9)])
    frames = np.cumsum(rate * 2.0)
    source = np.zeros(90, int), np.zeros(90, bool), frames, np.full(90, 2.0)
    rates = list_warp_rates(*source)
    assert (rates.min(), rates.max()) == (pytest.approx(0.9), pytest.approx(1.2))
    assert len(find_transitions(*source)) == 0


def test_seams_stand_where_the_clip_changes_or_jumps():
    source = provenance((0, 0.0, 40, 1.0), (1, 50.0, 30, 1.0), (1, 400.0, 30, 1.0), (1, 300.0, 20, 1.1))
    np.testing.assert_array_equal(find_transitions(*source), [40, 70, 100])
    assert list_warp_rates(*source).max() == pytest.approx(1.1)


def test_the_other_side_of_a_clip_is_another_clip():
    clip, mirrored, frames, stride = provenance((0, 0.0, 60, 1.0))
    mirrored[30:] = True
    np.testing.assert_array_equal(find_transitions(clip, mirrored, frames, stride), [30])


def test_a_jump_ahead_of_two_output_frames_is_a_seam_and_one_of_a_third_is_not():
    clip, mirrored, frames, stride = provenance((0, 0.0, 60, 1.0))
    np.testing.assert_array_equal(find_transitions(clip, mirrored, frames + 8.0 * (np.arange(60) >= 30), stride), [30])
    assert len(find_transitions(clip, mirrored, frames + 4.0 / 3 * (np.arange(60) >= 30), stride)) == 0


def test_frames_without_a_source_have_neither_seam_nor_rate():
    source = np.full(20, -1), np.zeros(20, bool), np.full(20, np.nan), np.ones(20)
    assert len(find_transitions(*source)) == 0
    assert len(list_warp_rates(*source)) == 0
    assert not find_replayed(*source, FPS).any()


def test_a_stride_replayed_is_a_loop():
    source = provenance((0, 0.0, 40, 1.0), (0, 0.0, 40, 1.0), (0, 0.0, 40, 1.0), stride=2.0)
    replayed = find_replayed(*source, FPS)
    assert not replayed[:40].any() and replayed[40:].all()


def test_a_stride_played_again_after_a_long_while_is_none():
    source = provenance((0, 0.0, 30, 1.0), (1, 0.0, 150, 1.0), (0, 0.0, 30, 1.0), stride=2.0)
    assert not find_replayed(*source, FPS).any()


def test_skipping_ahead_in_a_clip_is_no_loop():
    source = provenance((0, 0.0, 60, 1.0), (0, 140.0, 60, 1.0), stride=2.0)
    assert not find_replayed(*source, FPS).any()


def test_another_part_of_the_same_clip_is_no_loop():
    source = provenance((0, 1000.0, 60, 1.0), (0, 0.0, 60, 1.0), stride=2.0)
    assert not find_replayed(*source, FPS).any()
