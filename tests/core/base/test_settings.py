"""What a plan lets one set does what it says, and the defaults change nothing."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.base.settings import list_settings
from beyond_mocap.motion.track import Track, sample_track
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.search.cost_weights import Weights, balance_weights
from beyond_mocap.synthesis.synthesize import synthesize


@pytest.fixture(scope="module")
def take_of(library, track_of, timeline_of):
    """take_of(*lines, track=..., **plan) -> Take."""

    def make(*lines, track=None, **plan):
        return synthesize(library, Plan(track=track or track_of(), timeline=timeline_of(*lines), **plan))

    return make


@pytest.fixture(scope="module")
def noisy(track_of) -> Track:
    """Walking in a curve, then jogging, with 5 cm of noise."""
    track = track_of(lambda t: np.where(t < 4.0, 1.4, 2.8), turn=0.5)
    noise = np.random.default_rng(0).normal(0.0, 0.05, track.positions.shape)
    return Track(track.times, track.positions + noise)


def test_the_paper_s_alpha_changes_no_weight_and_more_of_it_favours_words():
    assert balance_weights(0.2) == Weights() == balance_weights(Plan.alpha)
    words, smooth = balance_weights(1.0), balance_weights(0.0)
    assert words.words > Weights().words and words.pose == words.switch == 0.0
    assert smooth.words == 0.0 and smooth.pose > Weights().pose and smooth.speed == words.speed == Weights().speed


@pytest.mark.parametrize("word, speed, less, more", [("walking", 2.2, 0.0, 0.2), ("jogging", 1.6, 0.05, 0.5)])
def test_by_path_more_alpha_plays_more_of_the_asked_words(take_of, track_of, word, speed, less, more):
    """At a speed between the two gaits."""
    takes = [take_of((1.0, 7.0, word), track=track_of(speed), alpha=alpha) for alpha in (less, more)]
    few, many = (np.mean([word in words for words in take.words]) for take in takes)
    assert few < 0.1 and many > 0.6


def test_omega_moves_the_threshold_between_gaits(take_of, track_of):
    """1.9 m/s is a third of the way from walking (1.4) to jogging (2.8)."""
    for omega, word in ((4.0, "jogging"), (2.0, "walking")):
        words = [span.words[0] for span in take_of(track=track_of(1.9), omega=omega).timeline.spans]
        assert word in words


def test_delta_leaves_distance_wrong(take_of, track_of):
    exact, slack = (take_of(track=track_of(2.0), method="distance", delta=delta) for delta in (0.1, 100.0))
    assert len(exact.seams) != len(slack.seams) or not np.array_equal(exact.clip_frame, slack.clip_frame)


def test_a_longer_track_window_is_calmer(take_of, noisy):
    rough, calm = (sample_track(noisy, 30.0, window).speed for window in (0.4, 2.0))
    assert np.abs(np.diff(calm)).mean() < 0.5 * np.abs(np.diff(rough)).mean()
    a, b = (take_of(track=noisy, track_window=window) for window in (0.4, 2.0))
    assert not np.array_equal(a.motion.root_positions, b.motion.root_positions)


def test_a_longer_seam_window_spreads_the_jump(take_of, noisy):
    def jumps(take):
        turn = np.abs(np.sum(take.motion.rotations[1:, 1:] * take.motion.rotations[:-1, 1:], axis=-1)).min(axis=1)
        return (1.0 - turn)[take.seams - 1].mean()

    hard, soft = (take_of(track=noisy, method="blocks", seam_window=window) for window in (0.0, 0.8))
    assert np.array_equal(hard.seams, soft.seams) and len(hard.seams)
    assert jumps(soft) < 0.7 * jumps(hard)


def test_a_seam_window_lasts_as_long_at_any_rate(take_of, noisy):
    """Frames farther from a seam than half the window are as they were."""
    for fps in (30.0, 60.0):
        hard, soft = (take_of(track=noisy, method="blocks", fps=fps, seam_window=window) for window in (0.0, 0.4))
        changed = np.flatnonzero(np.any(hard.motion.rotations[:, 1:] != soft.motion.rotations[:, 1:], axis=(1, 2)))
        away = np.abs(changed[:, None] - hard.seams).min(axis=1) / fps
        assert 0.1 < away.max() <= 0.2


def test_a_shorter_root_window_keeps_less_sway(take_of, track_of):
    track = track_of(1.4)
    off = [np.abs(take_of(track=track, root_window=window).motion.root_positions[:, 1]).mean() for window in (0.3, 1.5)]
    assert off[0] < 0.7 * off[1]


LIMITED = [row for row in (*list_settings("synthesis"), *list_settings("player")) if row.least is not None]


@pytest.mark.parametrize(
    "name, beyond", [(row.name, value) for row in LIMITED for value in (row.least - 0.01, row.most + 0.01)]
)
def test_numbers_beyond_their_limits_are_told_in_one_line(track_of, name, beyond):
    with pytest.raises(InputError, match=f"^{name}: ") as told:
        Plan(track=track_of(), **{name: beyond})
    assert "\n" not in str(told.value)
