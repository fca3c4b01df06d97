"""Takes whose players watch the ball: one strength for all, also in edits, and pins of the gaze go before it."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.construct import construction
from beyond_mocap.synthesis.construct.gaze import _limit_speed, estimate_look
from beyond_mocap.synthesis.plan import Pin, Plan
from beyond_mocap.synthesis.resynthesize import resynthesize
from beyond_mocap.synthesis.synthesize import synthesize


@pytest.fixture(scope="module")
def track(track_of):
    """Eight seconds of walking past a ball that lies at the left."""
    walk = track_of()
    return Track(walk.times, walk.positions, np.tile([9.0, 7.0, 0.11], (len(walk.times), 1)))


@pytest.fixture(scope="module")
def takes(library, track):
    """Takes by strength."""
    return {strength: synthesize(library, Plan(track=track, watch=strength)) for strength in (0.0, 0.5, 1.0)}


def measure_off_ball(library, take):
    """(T,) degrees between where the head looks and the ball."""
    places, world = forward_kinematics(take.motion)
    head = identify_joints(take.motion.skeleton).head
    way = quaternion.rotate(world[:, head], np.broadcast_to(estimate_look(library), (len(take.motion), 3)))
    away = take.ball.positions - places[:, head]
    return np.degrees(np.arccos(np.sum(way * away, axis=1) / np.linalg.norm(away, axis=1)))


def test_head_and_shoulders_turn_by_the_strength_and_nothing_else_does(library, takes):
    off = [measure_off_ball(library, take).mean() for take in takes.values()]
    assert off[0] - 10.0 > off[1] > off[2] + 5.0 and off[2] < 20.0
    body = identify_joints(library.skeleton)
    turned = {*body.spine, body.neck, body.head}
    before, after = takes[0.0].motion, takes[1.0].motion
    assert np.array_equal(before.root_positions, after.root_positions)
    assert set(np.flatnonzero(np.any(before.rotations != after.rotations, axis=(0, 2)))) == turned
    assert np.array_equal(takes[0.0].contacts, takes[1.0].contacts)


def test_strength_0_does_not_watch_at_all(library, track, takes, monkeypatch):
    monkeypatch.setattr(construction, "watch_ball", None)
    again = synthesize(library, Plan(track=track, watch=0.0))
    assert np.array_equal(again.motion.rotations, takes[0.0].motion.rotations)


def test_an_edited_stretch_watches_too(library, track, takes):
    """A track with a bump to the side: the new frames look at the ball as those of a whole synthesis do."""
    bump = np.exp(-((track.times - 4.0) ** 2) / 0.3)[:, None] * [0.0, -0.6]
    moved = Plan(track=Track(track.times, track.positions + bump, track.ball))
    edited, whole = resynthesize(library, moved, takes[1.0]), synthesize(library, moved)
    is_new = np.any(edited.motion.root_positions != takes[1.0].motion.root_positions, axis=1)
    assert is_new[100:140].all() and not is_new[:30].any()
    heedless = synthesize(library, replace(moved, watch=0.0))
    off, wanted, away = (measure_off_ball(library, take)[is_new] for take in (edited, whole, heedless))
    assert off.mean() < wanted.mean() + 1.0 and off.mean() < 0.5 * away.mean(), (off.mean(), wanted.mean(), away.mean())


def test_a_pin_of_the_gaze_goes_before_the_ball(library, track):
    take = synthesize(library, Plan(track=track, pins=(Pin(4.0, "gaze", (9.0, -4.0, 1.6), 0.5),)))
    off = measure_off_ball(library, take)
    assert take.pins[0].miss < np.radians(3.0)
    assert off[120:135].min() > 60.0 > 20.0 > off[90]


def test_a_strength_above_1_is_refused(track):
    with pytest.raises(InputError, match="watch: 1.5; expected 0 to 1"):
        Plan(track=track, watch=1.5)


@pytest.mark.parametrize("most", [0.05, 0.4, 3.0])
def test_angles_follow_at_a_limited_speed_from_frame_to_frame(most):
    angle = np.cumsum(np.random.default_rng(5).normal(scale=0.3, size=400))
    expected, now = [], angle[0]
    for wanted in angle:
        now = wanted if abs(wanted - now) <= most else now + most if wanted > now else now - most
        expected.append(now)
    assert np.array_equal(_limit_speed(angle, most), expected)
