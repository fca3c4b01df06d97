"""Facing and root on the ground: planted angles come out, and the root stays with the track."""

import numpy as np
import pytest

from beyond_mocap.motion.track import smooth_zero_phase_hann
from beyond_mocap.synthesis.construct.track_following import (
    AIRBORNE_FIRMNESS,
    CUT_FIRMNESS,
    add_sway,
    compute_turning_firmness,
    fit_heading,
    pull_to_track,
)

NO_CUTS = np.zeros(0, int)


def ahead(count, speed=2.0, angle=0.0):
    """Velocity (T, 2) in the facing frame of a body that goes at `angle` from where it faces."""
    return np.full((count, 2), speed) * [np.cos(angle), np.sin(angle)]


@pytest.mark.parametrize("angle", [0.0, 0.7, -1.5, 3.0])
def test_the_angle_between_facing_and_travel_is_the_recording_s(angle):
    direction = np.full(90, 0.4)
    found = fit_heading(direction, np.full(90, 2.0), ahead(90, angle=angle), np.zeros(90))
    assert np.allclose(np.exp(1j * (found + angle)), np.exp(1j * direction), atol=1e-9)


def test_a_bow_is_followed():
    turn = np.full(120, 0.03)
    direction = 1.0 + np.cumsum(turn)
    assert np.allclose(fit_heading(direction, np.full(120, 3.0), ahead(120), turn), direction, atol=1e-6)


def test_several_full_turns():
    turn = np.full(600, 0.05)
    direction = np.cumsum(turn)
    wrapped = (direction + np.pi) % (2 * np.pi) - np.pi
    found = fit_heading(wrapped, np.full(600, 3.0), ahead(600), turn)
    assert np.allclose(np.exp(1j * found), np.exp(1j * direction), atol=1e-6)
    assert np.abs(np.diff(found)).max() < 0.06


def test_a_recording_that_goes_straight_is_bent_to_the_track():
    direction = np.concatenate([np.zeros(60), np.linspace(0, 1.5, 60), np.full(60, 1.5)])
    found = fit_heading(direction, np.full(180, 3.0), ahead(180), np.zeros(180))
    assert np.abs(found[[0, -1]] - direction[[0, -1]]).max() < 0.05
    assert np.abs(found - direction).max() < 0.25 and np.abs(np.diff(found, 2)).max() < 0.01


def test_who_stands_turns_as_recorded_not_with_the_track_s_noise():
    random = np.random.default_rng(0)
    turn = np.full(90, 0.01)
    noisy = random.uniform(-3, 3, 90)
    found = fit_heading(noisy, np.full(90, 0.05), ahead(90, 0.02), turn)
    assert np.allclose(np.diff(found), 0.01, atol=2e-3)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_frames(count):
    found = fit_heading(np.full(count, 0.3), np.full(count, 2.0), ahead(count), np.zeros(count))
    assert np.allclose(found, 0.3, atol=1e-6)


def test_a_given_facing_stays_and_the_rest_joins_it():
    """One end is given a full turn further: the free middle takes the short way there."""
    given = np.full(90, np.nan)
    given[:20], given[70:] = 0.2, 0.5 + 2 * np.pi
    found = fit_heading(np.full(90, 0.3), np.full(90, 0.0), ahead(90), np.zeros(90), given)
    assert np.allclose(found[:20], 0.2, atol=1e-6) and np.allclose(found[70:], 0.5, atol=1e-6)
    assert np.all(np.diff(found[20:70]) > 0) and np.abs(np.diff(found)).max() < 0.02


def test_sway_turns_with_the_body():
    sway = np.tile([0.1, 0.02], (3, 1))
    out = add_sway(np.array([[5.0, 5.0]] * 3), sway, np.array([0.0, np.pi / 2, np.pi]))
    assert np.allclose(out, [[5.1, 5.02], [4.98, 5.1], [4.9, 4.98]])


@pytest.mark.parametrize("fps", [25.0, 30.0, 60.0])
def test_what_drifts_is_pulled_back_and_what_sways_stays(fps):
    time = np.arange(int(8 * fps)) / fps
    track = np.stack([2.0 * time, np.sin(0.7 * time)], axis=1)
    sway = 0.03 * np.stack([np.sin(2 * np.pi * 1.9 * time), np.cos(2 * np.pi * 1.9 * time)], axis=1)
    drift = 0.4 * np.stack([np.sin(0.3 * time), 0.2 * time / 8], axis=1)
    out = pull_to_track(track + sway + drift, track, fps)
    apart = smooth_zero_phase_hann(out, fps, 1.5) - smooth_zero_phase_hann(track, fps, 1.5)
    assert np.linalg.norm(apart, axis=1).mean() < 0.003
    middle = (time > 1.5) & (time < 6.5)
    assert np.abs((out - track - sway)[middle]).max() < 0.01


@pytest.mark.parametrize("count", [1, 2, 3, 10])
def test_short_roots(count):
    root = np.arange(2.0 * count).reshape(count, 2)
    assert np.all(np.isfinite(pull_to_track(root + 0.3, root, 30.0)))


def test_who_lies_does_not_turn_but_who_stands_up_afterwards_does():
    count = 120
    lying = (np.arange(count) >= 30) & (np.arange(count) < 90)
    standing = np.repeat(~lying, 4).reshape(count, 2, 2)
    height = np.where(lying, 0.2, 0.9)
    direction = np.where(np.arange(count) < 15, 0.0, 2.0)
    speed = np.where((np.arange(count) < 15) | (np.arange(count) > 105), 2.0, 0.0)
    velocity = np.tile([2.0, 0.0], (count, 1))
    firm = compute_turning_firmness(standing, height, NO_CUTS, 30.0)
    assert (firm[lying] == AIRBORNE_FIRMNESS).all() and (firm[~lying] == 1.0).all()
    loose, kept = (fit_heading(direction, speed, velocity, np.zeros(count), firm=f) for f in (1.0, firm))
    assert np.ptp(loose[lying]) > 0.8 and np.ptp(kept[lying]) < 0.25
    assert kept[0] == pytest.approx(0.0, abs=0.3) and kept[-1] == pytest.approx(2.0, abs=0.3)


def test_near_a_cut_a_body_turns_as_recorded():
    count = 90
    firm = compute_turning_firmness(np.ones((count, 2, 2), bool), np.full(count, 0.9), np.array([45]), 30.0)
    assert firm[45] == CUT_FIRMNESS and firm[0] == firm[-1] == 1.0 and (np.diff(firm[45:]) <= 0.0).all()
    # the angle between travel and heading jumps by 60 degrees at the cut
    angle = np.where(np.arange(count) < 45, 0.0, np.radians(60.0))
    velocity = 1.5 * np.column_stack([np.cos(angle), np.sin(angle)])
    fastest = [np.abs(np.diff(fit_heading(np.zeros(count), np.full(count, 1.5), velocity, np.zeros(count),
                                          firm=one))).max() for one in (1.0, firm)]
    assert fastest[1] < 0.5 * fastest[0]


def test_the_flights_of_running_and_a_single_step_stay_as_they_were():
    standing = np.ones((60, 2, 2), bool)
    standing[10:17] = standing[30:37] = False
    assert (compute_turning_firmness(standing, np.full(60, 0.9), NO_CUTS, 30.0) == 1.0).all()
