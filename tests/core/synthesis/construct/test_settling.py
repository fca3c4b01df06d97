"""A slow body goes where its feet carry it, near its track; at speed it is on its track."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.library.library import Library
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.track import Track, sample_track
from beyond_mocap.motion.track.resting_place import MOST_LEEWAY
from beyond_mocap.synthesis.construct.settling import REST_FIRMNESS, measure_foot_moves, measure_rest, settle_on_track
from beyond_mocap.synthesis.construct.track_following import add_sway
from beyond_mocap.synthesis.heading_plan import plan_track
from beyond_mocap.synthesis.search.edit_list import EditList
from beyond_mocap.synthesis.search.source_frames import fetch_motion

FPS = 30.0


def source_of(library: Library, path: str, count: int):
    clip = next(i for i, clip in enumerate(library.clips) if clip.path == path and not clip.mirrored)
    frames = library.frames.first[clip] + np.arange(count, dtype=float)
    edit = EditList(np.full(count, clip), frames, np.zeros(0, int), ())
    return fetch_motion(library, edit, np.arange(count, dtype=float), FPS)


def planned(count, speed):
    times = np.arange(count) / FPS
    return plan_track(sample_track(Track(times, np.column_stack([speed * times, 0.0 * times])), FPS))


@pytest.mark.parametrize("path, speed", [("walk.bvh", 1.4), ("jog.bvh", 2.8), ("stand.bvh", 0.0)])
def test_feet_carry_a_body_as_far_as_it_was_recorded(library, path, speed):
    source = source_of(library, path, 120)
    moves, turn = measure_foot_moves(library.skeleton, source, FPS)
    assert np.linalg.norm(moves.sum(axis=0)) == pytest.approx(speed * 119 / FPS, rel=0.08, abs=0.03)
    assert abs(np.degrees(turn.sum())) < 8.0


@pytest.mark.parametrize("frames, turned", [(50, 50.0), (5, 10.0)])
def test_feet_turn_a_body_slowly_only(library, frames, turned):
    """Both stand while the pose turns over them: in a second as a body does it, in some frames as a cut does."""
    source, at = source_of(library, "stand.bvh", 60), np.arange(60)
    angle = np.radians(50.0) * np.clip((at - 4) / frames, 0.0, 1.0)
    pose = source.pose.copy()
    pose[:, 0] = quaternion.multiply(quaternion.from_up_angle(angle), pose[:, 0])
    _, turn = measure_foot_moves(library.skeleton, replace(source, pose=pose), FPS)
    own = np.degrees(source.turn[1:].sum())
    assert -np.degrees(turn.sum()) + own == pytest.approx(turned, abs=3.0)
    assert np.abs(turn - source.turn[1:]).max() < np.radians(45.0) / FPS + 1e-9


def test_a_standing_body_rests_beside_a_place_that_shifts(library):
    """The recording stands; the plan moves 4 cm away over two seconds: the body may stay."""
    source, heading = source_of(library, "stand.bvh", 120), np.zeros(120)
    track = planned(120, 0.02)
    moves, _ = measure_foot_moves(library.skeleton, source, FPS)
    free = np.full((120, 2), np.nan)
    settled = settle_on_track(track, source, moves, heading, free)
    root = add_sway(settled.positions, source.sway, heading)
    carried = np.concatenate([[[0.0, 0.0]], np.cumsum(moves, axis=0)])
    assert np.linalg.norm(root - root[0] - carried, axis=1).max() < 0.01
    assert np.linalg.norm(settled.positions - track.positions, axis=1).max() < MOST_LEEWAY + 0.02


def test_a_body_at_speed_is_on_its_track(library):
    source, track = source_of(library, "walk.bvh", 120), planned(120, 2.0)
    moves, _ = measure_foot_moves(library.skeleton, source, FPS)
    settled = settle_on_track(track, source, moves, np.zeros(120), np.full((120, 2), np.nan))
    assert np.linalg.norm(settled.positions - track.positions, axis=1).max() < 0.003


def test_a_given_root_stays(library):
    source, track, heading = source_of(library, "stand.bvh", 120), planned(120, 0.0), np.zeros(120)
    moves, _ = measure_foot_moves(library.skeleton, source, FPS)
    given = np.full((120, 2), np.nan)
    given[40:50] = [0.03, -0.02]
    settled = settle_on_track(track, source, moves, heading, given)
    root = add_sway(settled.positions, source.sway, heading)
    np.testing.assert_allclose(root[40:50], given[40:50], atol=1e-4)


def test_both_feet_hold_a_slow_body_only(library):
    source = source_of(library, "stand.bvh", 60)
    assert np.all(measure_rest(source, np.zeros(60)) == REST_FIRMNESS)
    assert np.all(measure_rest(source, np.full(60, 2.0)) == 1.0)
