"""Tracks: planted faults are found and mended, real ones stay on their samples, sampling keeps curves."""

import csv
import pathlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.track import (
    BALL_RADIUS,
    Track,
    clean_track,
    compute_travel_direction,
    outliers,
    sample_track,
    smooth_zero_phase_hann,
)

DATA = pathlib.Path(__file__).resolve().parents[3] / ".." / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the recordings in ../shared/data are not here")


def path(times):
    """A made run (N, 2) m: sprints, brakes, turns, at most 7.5 m/s and 6 m/s^2."""
    x = 4.5 * times + 3.0 * np.sin(0.8 * times)
    return np.column_stack([x, 6.0 * np.sin(0.5 * times) + 1.0 * np.cos(1.3 * times)])


def made(rate=25.0, seconds=20.0, noise=0.01, seed=0):
    """A track of `path` with white noise, and its true positions."""
    times = np.arange(int(seconds * rate) + 1) / rate
    truth = path(times)
    return Track(times, truth + np.random.default_rng(seed).normal(0, noise, truth.shape)), truth


def distance(a, b):
    return np.linalg.norm(a - b, axis=-1)


def root_error(sampled):
    """(T,) m: smoothed and raw positions, both through the 1.5 s window."""
    window = [smooth_zero_phase_hann(values, sampled.fps, 1.5) for values in (sampled.positions, sampled.raw)]
    return distance(*window)


# --- clean


def test_a_clean_track_comes_back_equal():
    track, _ = made()
    cleaned, report = clean_track(track)
    assert np.array_equal(cleaned.positions, track.positions) and not cleaned.outlier.any() and not cleaned.filled.any()
    assert report.lines == () and report.rate == pytest.approx(25.0)
    again, _ = clean_track(cleaned)
    assert np.array_equal(again.positions, cleaned.positions)


@pytest.mark.parametrize("rate", [10.0, 25.0, 50.0])
@pytest.mark.parametrize("size", [0.45, 0.8, 1.4])
def test_planted_spikes_are_found_and_nothing_else(rate, size):
    track, truth = made(rate)
    places = np.array([0.11, 0.37, 0.5, 0.82]) * len(track)
    places = places.astype(int)
    angle = np.arange(4.0)
    positions = track.positions.copy()
    positions[places] += size * np.column_stack([np.cos(angle), np.sin(angle)])
    cleaned, report = clean_track(Track(track.times, positions))
    assert np.flatnonzero(cleaned.outlier).tolist() == places.tolist()
    assert distance(cleaned.positions, truth)[places].max() < 0.08
    assert report.outliers == 4 and f"{track.times[places[0]]:.2f}" in report.lines[0]


@pytest.mark.parametrize("place", [0, 1, -2, -1])
def test_spikes_at_the_ends_are_found(place):
    track, truth = made()
    positions = track.positions.copy()
    positions[place] += (0.9, 0.5)
    cleaned, _ = clean_track(Track(track.times, positions))
    assert np.flatnonzero(cleaned.outlier).tolist() == [place % len(track)]
    assert distance(cleaned.positions, truth).max() < 0.1


def test_a_feed_that_is_away_for_some_samples_is_mended():
    track, truth = made()
    positions = track.positions.copy()
    positions[200:206] += (1.0, -0.8)
    cleaned, _ = clean_track(Track(track.times, positions))
    assert np.flatnonzero(cleaned.outlier).tolist() == list(range(200, 206))
    assert distance(cleaned.positions, truth).max() < 0.1


def test_a_feed_that_coasts_and_snaps_back_is_mended_from_where_it_last_saw():
    track, truth = made(noise=0.005)
    positions = np.round(track.positions, 2)
    velocity = (positions[282] - positions[270]) / 12
    coast = positions[282] + velocity * np.arange(1, 19)[:, None]
    positions[283:301] = np.round(coast, 2)
    assert distance(positions, truth)[300] > 0.5
    cleaned, _ = clean_track(Track(track.times, positions))
    assert cleaned.outlier[284:301].all() and not cleaned.outlier[301:].any() and not cleaned.outlier[:270].any()
    assert distance(cleaned.positions, truth).max() < 0.5 * distance(positions, truth).max()
    speed = distance(cleaned.positions[1:], cleaned.positions[:-1]) * 25
    assert speed.max() < 12


def test_hard_but_human_turns_are_left_alone():
    times = np.arange(0, 6, 0.04)
    x = np.where(times < 3, 7.0 * times, 21.0 - 5.0 * (times - 3))
    x = smooth_zero_phase_hann(x[:, None], 25, 1.0)[:, 0]
    cleaned, report = clean_track(Track(times, np.column_stack([x, np.zeros_like(x)])))
    assert not cleaned.outlier.any() and report.lines == ()


def test_gaps_are_filled_marked_and_told():
    track, truth = made()
    keep = np.ones(len(track), bool)
    keep[250:270] = False
    cleaned, report = clean_track(Track(track.times[keep], track.positions[keep]))
    assert len(cleaned) == len(track) and np.flatnonzero(cleaned.filled).tolist() == list(range(250, 270))
    np.testing.assert_allclose(cleaned.times, track.times, atol=1e-9)
    assert distance(cleaned.positions, truth).max() < 0.1
    assert report.filled == 20 and report.gaps == ((pytest.approx(9.96), pytest.approx(10.8)),)
    assert "10.00-10.76" in report.lines[0]


def test_a_long_gap_is_not_standing_and_is_warned_of():
    track, _ = made()
    keep = (track.times < 6) | (track.times > 10)
    cleaned, report = clean_track(Track(track.times[keep], track.positions[keep]))
    sampled = sample_track(cleaned, 30)
    inside = (sampled.times > 6.1) & (sampled.times < 9.9)
    assert not sampled.valid[inside].any() and sampled.valid[sampled.times < 5.9].all()
    assert sampled.speed[inside].min() > 1.0
    assert any("no samples from" in line for line in report.warnings)


def test_long_tracks_are_searched_for_outliers_in_parts(monkeypatch):
    track, _ = made(noise=0.02, seed=3)
    positions = track.positions + np.where(track.times > 9.0, 1.5, 0.0)[:, None]
    whole = outliers.detect_outliers(track.times, positions, 0.02)
    monkeypatch.setattr(outliers, "_BLOCK", 100)
    parts = outliers.detect_outliers(track.times, positions, 0.02)
    assert whole[0].any() and np.array_equal(whole[0], parts[0]) and whole[1] == parts[1]


@pytest.mark.parametrize("rate", [10.0, 20.0, 50.0])
def test_everything_at_once_is_still_the_same_run(rate):
    rng = np.random.default_rng(11)
    track, truth = made(rate, noise=0.01, seed=4)
    positions = track.positions.copy()
    places = np.array([0.15, 0.45, 0.75]) * len(track)
    positions[places.astype(int)] += (0.7, -0.6)
    positions[int(0.3 * len(track))] = np.nan
    keep = np.abs(track.times - 12.0) > 0.4
    shuffled = rng.permutation(np.flatnonzero(keep))
    cleaned, report = clean_track(Track(track.times[shuffled], positions[shuffled]))
    np.testing.assert_allclose(cleaned.times, track.times, atol=1e-9)
    assert report.outliers == 3 and report.filled == 1 + np.count_nonzero(~keep)
    sampled = sample_track(cleaned, 30)
    error = distance(sampled.positions, path(sampled.times))
    assert error.mean() < 0.02 and error.max() < 0.2


def test_missing_positions_keep_the_clock():
    track, truth = made()
    positions = track.positions.copy()
    positions[:10], positions[100:102], positions[-5:] = np.nan, np.nan, np.nan
    cleaned, report = clean_track(Track(track.times, positions))
    assert np.array_equal(cleaned.times, track.times) and np.isfinite(cleaned.positions).all()
    assert report.filled == 17 and cleaned.filled[:10].all() and cleaned.filled[-5:].all()
    assert distance(cleaned.positions, truth)[100:102].max() < 0.05
    assert distance(cleaned.positions, truth).max() < 1.5


def test_times_out_of_order_and_repeated_are_put_right_and_told():
    track, _ = made()
    order = np.arange(len(track))
    order[[50, 51]] = [51, 50]
    rows = np.insert(order, 80, 80)
    cleaned, report = clean_track(Track(track.times[rows], track.positions[rows]))
    assert np.array_equal(cleaned.times, track.times) and report.merged == 1
    np.testing.assert_allclose(cleaned.positions, track.positions)
    assert "out of order" in report.lines[0] and "3.20" in report.lines[1]


def test_rows_without_a_time_are_dropped_and_told():
    track, _ = made(seconds=2)
    times = track.times.copy()
    times[7] = np.nan
    cleaned, report = clean_track(Track(times, track.positions))
    assert report.dropped == 1 and len(cleaned) == len(track) - 1 and "without a time" in report.lines[0]


def test_a_step_too_long_for_one_player_is_kept_and_warned_of():
    track, _ = made()
    positions = track.positions.copy()
    positions[300:] += (20.0, 0.0)
    cleaned, report = clean_track(Track(track.times, positions))
    assert not cleaned.outlier.any() and any("12.00" in line for line in report.warnings)


@pytest.mark.parametrize("rows", [0, 1])
def test_too_few_samples_are_refused(rows):
    with pytest.raises(InputError, match="at least two"):
        clean_track(Track(np.arange(float(rows)), np.zeros((rows, 2))))
    with pytest.raises(InputError):
        sample_track(Track(np.arange(float(rows)), np.zeros((rows, 2))), 30)


def test_an_endless_gap_is_refused():
    with pytest.raises(InputError, match="nothing between"):
        clean_track(Track([0.0, 0.1, 0.2, 9e9], np.zeros((4, 2))))


# --- ball


def test_sentinels_of_an_absent_ball_are_unknown():
    track, _ = made(seconds=8)
    ball = np.column_stack([30.0 + track.times, np.zeros(len(track)), np.full(len(track), 0.5)])
    ball[20:40] = (50.0, 50.0, -10.0)
    ball[60:90] = 0.0
    ball[120] = (1e9, 0, 0)
    cleaned, report = clean_track(Track(track.times, track.positions, ball))
    unknown = ~np.isfinite(cleaned.ball[:, 0])
    assert np.flatnonzero(unknown).tolist() == [*range(20, 40), *range(60, 90), 120]
    assert any(line.startswith("51 samples without a ball") for line in report.lines)
    sampled = sample_track(cleaned, 30)
    absent = (sampled.times > 1) & (sampled.times < 1.4)
    assert np.isfinite(sampled.ball).all() and not sampled.ball_measured[absent].any()


def test_a_ball_that_rolls_through_the_centre_stays():
    times = np.arange(0, 4, 0.04)
    x = np.minimum(times - 2.0, 0.0)
    ball = np.column_stack([x, np.zeros_like(x), np.full_like(x, 0.11)])
    cleaned, _ = clean_track(Track(times, path(times), ball))
    assert np.isfinite(cleaned.ball).all()


def test_a_ball_without_height_lies_on_the_grass():
    track, _ = made(seconds=4)
    ball = np.column_stack([track.positions, np.full(len(track), np.nan)])
    cleaned, _ = clean_track(Track(track.times, track.positions, ball))
    sampled = sample_track(cleaned, 30)
    assert not cleaned.ball_height_known.any() and np.all(sampled.ball[:, 2] == BALL_RADIUS)
    assert sampled.ball_measured.all()


def test_no_ball_is_no_ball():
    sampled = sample_track(made(seconds=2)[0], 30)
    assert np.isnan(sampled.ball).all() and not sampled.ball_measured.any()


# --- sample


@pytest.mark.parametrize("fps", [10.0, 24.0, 25.0, 29.97, 30.0, 60.0, 120.0])
@pytest.mark.parametrize("rate", [5.0, 10.0, 25.0, 100.0])
def test_sampling_meets_its_form_at_any_rate(rate, fps):
    track, truth = made(rate, seconds=6.0, noise=0.0)
    sampled = sample_track(track, fps)
    assert len(sampled) == int(np.floor(6.0 * fps + 1e-6)) + 1
    np.testing.assert_allclose(sampled.times, np.arange(len(sampled)) / fps)
    chord = 6.0 / rate**2 / 8
    assert distance(sampled.positions, path(sampled.times)).max() < 0.015 + 1.5 * chord
    inner = slice(int(0.5 * fps), -int(0.5 * fps))
    truth = np.gradient(path(sampled.times), 1 / fps, axis=0)[inner]
    assert distance(sampled.velocity[inner], truth).max() < 0.1 + 6.0 / rate / 4
    assert not sampled.positions.flags.writeable and sampled.valid.all()


def test_jitter_is_smoothed_and_curves_are_kept():
    track, _ = made(noise=0.01)
    sampled = sample_track(track, 30)
    truth = path(sampled.times)
    inner = slice(15, -15)
    assert distance(sampled.positions, truth)[inner].mean() < 0.007
    velocity = np.gradient(truth, 1 / 30, axis=0)
    assert np.sqrt(np.mean(distance(sampled.velocity, velocity)[inner] ** 2)) < 0.04
    assert root_error(sampled).mean() < 0.003 and np.percentile(root_error(sampled), 95) < 0.01


def test_irregular_times_are_fine():
    rng = np.random.default_rng(5)
    times = np.cumsum(rng.uniform(0.02, 0.11, 300))
    sampled = sample_track(clean_track(Track(times, path(times)))[0], 30)
    assert distance(sampled.positions, path(sampled.times)).max() < 0.02
    assert sampled.times[0] == times[0]


def test_outliers_do_not_pull_the_raw_path():
    track, truth = made(noise=0.0)
    positions = track.positions.copy()
    positions[100] += 1.0
    cleaned, _ = clean_track(Track(track.times, positions))
    sampled = sample_track(cleaned, 25)
    assert distance(sampled.raw, truth).max() < 0.01


def test_far_edits_change_nothing_bit_for_bit():
    track, _ = made()
    positions = track.positions.copy()
    positions[240:260] += 0.5
    a, b = sample_track(track, 30), sample_track(Track(track.times, positions), 30)
    far = (a.times < 9.6 - 1.85) | (a.times > 10.36 + 1.85)
    assert np.array_equal(a.positions[far], b.positions[far]) and not np.array_equal(a.positions, b.positions)


def test_the_direction_holds_through_standing_and_turns_before_setting_off():
    fps = 30
    velocity = np.zeros((300, 2))
    velocity[:100] = (2.0, 0.0)
    velocity[100:200] = np.random.default_rng(1).normal(0, 0.1, (100, 2))
    velocity[200:] = (-0.1, 2.0)
    direction = compute_travel_direction(velocity, fps)
    assert np.all(direction[:180] == 0.0) and np.allclose(direction[200:], np.arctan2(2.0, -0.1))
    assert np.all(np.diff(direction[186:201]) > 0) and np.abs(np.diff(direction)).max() < 0.2


def test_the_direction_has_no_jumps_on_a_circle():
    angle = np.linspace(0, 6 * np.pi, 400)
    direction = compute_travel_direction(3.0 * np.column_stack([np.cos(angle), np.sin(angle)]), 30)
    np.testing.assert_allclose(direction, angle, atol=1e-9)
    assert np.all(compute_travel_direction(np.zeros((5, 2)), 30) == 0.0)


def test_the_window_keeps_lines_and_ends():
    line = np.column_stack([np.arange(50.0), 3.0 - 2.0 * np.arange(50.0)])
    np.testing.assert_allclose(smooth_zero_phase_hann(line, 30, 1.5), line, atol=1e-10)
    short = np.array([[0.0, 1.0], [2.0, 0.0], [1.0, 1.0]])
    smooth = smooth_zero_phase_hann(short, 30, 1.5)
    np.testing.assert_allclose(smooth[[0, -1]], short[[0, -1]], atol=1e-10)
    bend = 2.0 * (np.arange(200) / 30.0)[:, None] ** 2
    lifted = (smooth_zero_phase_hann(bend, 30, 1.5) - bend)[100, 0]
    assert lifted == pytest.approx(4.0 * 0.0367, rel=0.01)  # bias = acceleration * 0.037 s^2


@given(
    st.lists(
        st.tuples(
            st.one_of(st.floats(0, 20), st.sampled_from([np.nan, np.inf, 3.0])),
            *[st.one_of(st.floats(-60, 60), st.just(np.nan)) for _ in range(2)],
            *[st.one_of(st.floats(-1e6, 1e6), st.sampled_from([np.nan, 0.0, -10.0])) for _ in range(3)],
        ),
        max_size=40,
    )
)
@settings(max_examples=200, deadline=None)
def test_any_samples_are_cleaned_or_refused(rows):
    table = np.array(rows, dtype=float).reshape(-1, 6)
    track = Track(table[:, 0], table[:, 1:3], table[:, 3:])
    try:
        cleaned, report = clean_track(track)
        sampled = sample_track(cleaned, 30)
    except InputError as error:
        assert "\n" not in str(error)
        return
    assert np.isfinite(cleaned.positions).all() and np.all(np.diff(cleaned.times) > 0)
    assert report.filled == cleaned.filled.sum() and all("\n" not in line for line in report.lines)
    for values in (sampled.positions, sampled.raw, sampled.velocity, sampled.direction):
        assert np.isfinite(values).all() and len(values) == len(sampled)


@needs_data
@pytest.mark.parametrize("rate", [None, 10.0])
@pytest.mark.parametrize("number", range(1, 6))
def test_real_tracks_stay_on_their_samples(number, rate):
    with open(DATA / "tracking" / "scenarios" / f"scenario{number}_track.csv", encoding="utf-8") as file:
        rows = [(float(row["time_s"]), float(row["x_m"]), float(row["y_m"])) for row in csv.DictReader(file)]
    table = np.array(rows)
    if rate:
        times = np.arange(table[0, 0], table[-1, 0] + 1e-9, 1 / rate)
        table = np.column_stack([times, *(np.interp(times, table[:, 0], column).round(2)
                                          for column in table[:, 1:].T)])
    cleaned, report = clean_track(Track(table[:, 0], table[:, 1:]))
    sampled = sample_track(cleaned, 30)
    assert report.outliers == 0 and sampled.valid.all()
    assert root_error(sampled).mean() < 0.003 and np.percentile(root_error(sampled), 95) < 0.01
    acceleration = np.gradient(sampled.velocity, 1 / 30, axis=0)
    assert np.sqrt(np.mean(acceleration**2) * 2) < 5.0


@pytest.mark.parametrize("factor, told", [
    (7.0, "not a player's .* check the units"), (1000.0, "millimetres"),
    (100.0, "look like centimetres .* expected metres; divide x and y by 100"),
])
def test_other_units_are_refused(track_of, factor, told):
    track = track_of(lambda t: 2.0 + 1.5 * np.sin(t), 20.0, turn=0.3)
    with pytest.raises(InputError, match=told):
        clean_track(replace(track, positions=factor * track.positions))


@pytest.mark.parametrize("rate", [10.0, 25.0])
def test_a_track_that_jitters_by_20_cm_is_smoothed_and_told(rate):
    noisy, truth = made(rate=rate, noise=0.2)
    cleaned, report = clean_track(noisy)
    before, after = (np.sqrt(np.mean(distance(one.positions, truth) ** 2)) for one in (noisy, cleaned))
    assert after < 0.6 * before
    assert any("jitter by" in line and "smoothed over" in line for line in report.warnings)


@pytest.mark.parametrize("rate", [10.0, 25.0])
def test_smoothing_jitter_keeps_to_the_samples_beside_a_gap(rate):
    times = np.arange(int(20 * rate) + 1) / rate
    times = times[(times <= 8.0) | (times >= 13.0)]
    truth = np.column_stack([5.0 * times, np.zeros_like(times)])
    cleaned, report = clean_track(Track(times, truth + np.random.default_rng(0).normal(0, 0.2, truth.shape)))
    assert any("jitter by" in line for line in report.warnings)
    assert np.array_equal(cleaned.times[cleaned.is_measured], times)
    assert distance(cleaned.positions[cleaned.is_measured], truth).max() < 0.4  # as the samples themselves


@pytest.mark.parametrize("rate", [10.0, 25.0])
@pytest.mark.parametrize("samples, offset", [(1, (8.0, 0.0)), (4, (3.0, 4.0))])
def test_what_jumps_away_from_a_track_that_jitters_is_replaced_and_told(rate, samples, offset):
    noisy, truth = made(rate=rate, noise=0.2, seed=2)
    away = slice(int(10 * rate), int(10 * rate) + samples)
    positions = noisy.positions.copy()
    positions[away] += offset
    cleaned, report = clean_track(replace(noisy, positions=positions))
    assert np.array_equal(np.flatnonzero(cleaned.outlier), np.arange(len(truth))[away])
    assert any("jitter by" in line for line in report.lines) and any("replaced" in line for line in report.lines)
    assert distance(cleaned.positions, truth).max() < (0.3 if samples == 1 else 0.35)


@pytest.mark.parametrize("rate", [10.0, 25.0])
def test_a_track_that_jitters_is_not_smoothed_across_a_step_that_is_left(rate):
    noisy, truth = made(rate=rate, noise=0.2, seed=2)
    step = np.where(noisy.times[:, None] < 10.0, 0.0, (3.0, 4.0))
    cleaned, report = clean_track(replace(noisy, positions=noisy.positions + step))
    assert any("jitter by" in line for line in report.warnings)
    assert any("left as they are: 10.00 s" in line for line in report.warnings)
    assert not cleaned.outlier.any() and distance(cleaned.positions, truth + step).max() < 0.3


def test_the_noise_of_usual_systems_is_left_as_it_is():
    noisy, _ = made(noise=0.02)
    cleaned, report = clean_track(noisy)
    assert np.array_equal(cleaned.positions, noisy.positions) and report.warnings == ()
