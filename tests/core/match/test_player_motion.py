"""A player searched in windows, joined and laid out: what every span of him has to be."""

import re
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.match.pieces import motion_parts
from beyond_mocap.match.player_motion import StretchWindows, construct_player
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.track import sample_track
from beyond_mocap.synthesis.known_body import KnownBody
from beyond_mocap.synthesis.quality.playback import playback_from_take
from beyond_mocap.synthesis.quality.unmet_constraints import report_unmet_constraints
from beyond_mocap.synthesis.resolve_plan import resolve_plan
from beyond_mocap.synthesis.synthesize import construct_take, synthesize

from .conftest import KICK_TIME


def at_rate(player, fps: float):
    stretches = tuple(replace(one, plan=replace(one.plan, fps=fps)) for one in player.stretches)
    return replace(player, stretches=stretches)


def same_frames(whole, part) -> bool:
    """Whether a take shows, bit for bit but for the signs of quaternions, what another one shows at that time."""
    first = int(round((part.start_time - whole.start_time) * whole.motion.fps))
    here = slice(first, first + len(part.motion))
    turned, other = whole.motion.rotations[here], part.motion.rotations
    signs = np.where(np.sum(turned * other, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    return np.array_equal(turned * signs, other) and all(
        np.array_equal(a, b) for a, b in [
            (whole.motion.root_positions[here], part.motion.root_positions), (whole.contacts[here], part.contacts),
            (whole.clip_frame[here], part.clip_frame), (whole.mirrored[here], part.mirrored),
            (np.array(whole.clips)[whole.clip[here]], np.array(part.clips)[part.clip]),
        ]
    )  # fmt: skip


@pytest.mark.parametrize("fps", [30.0, 24000 / 1001])
def test_any_span_shows_the_same_frames(library, weaving_player, fps):
    player = at_rate(weaving_player, fps)
    (whole,) = construct_player(library, player, 0.0, 100.0)
    assert len(whole.motion) == int(np.floor(25.0 * fps + 1e-6)) + 1
    for start, end in [(5.0, 30.0), (15.9, 17.3), (16.1, 24.0), (23.0, 29.0)]:
        (part,) = construct_player(library, player, start, end)
        assert start <= part.start_time < start + 1.0 / fps + 1e-6 and len(part.motion) > (end - start) * fps - 2
        assert same_frames(whole, part)
        assert len(part.keys) == (start <= KICK_TIME <= end)
        assert part.timeline.spans[0].start == pytest.approx(part.start_time)


def test_bodies_of_another_skeleton_are_told(library, weaving_player):
    (stretch,) = weaving_player.stretches
    body = KnownBody(200, 30.0, np.zeros((30, 3)), np.ones((30, 3, 4), np.int16), np.zeros((30, 2, 2), bool))
    player = replace(weaving_player, stretches=(replace(stretch, plan=replace(stretch.plan, bodies=(body,))),))
    with pytest.raises(InputError, match="expected 3, as the player's bodies have; run the match again"):
        construct_player(library, player, 5.0, 30.0)


def test_stored_windows_show_what_is_constructed(library, weaving_player, monkeypatch):
    monkeypatch.setattr(motion_parts, "BLOCK_WINDOWS", 2)
    (stretch,), window = weaving_player.stretches, weaving_player.window
    blocks = motion_parts.list_blocks(weaving_player)
    contents = [content for _, block in blocks for content in block.construct(library)]
    grid = StretchWindows(stretch, window)
    assert len(contents) == len(grid.edges) - 1 > 2
    parts = tuple((content, 0, end - first) for content, first, end in zip(contents, grid.edges, grid.edges[1:]))
    stored = motion_parts.MotionSpan(grid.cut_plan(0, grid.count), parts).load_take(library.skeleton)
    (whole,) = construct_player(library, weaving_player, 0.0, 100.0)
    assert same_frames(whole, stored)
    for name in ("start_time", "words", "timeline", "keys", "warnings", "dribble_touches", "method", "seed"):
        assert getattr(stored, name) == getattr(whole, name), name
    for name in ("seams", "correction", "ik_miss", "stepped", "planned_heading"):
        np.testing.assert_array_equal(getattr(stored, name), getattr(whole, name))


def test_he_shows_the_whole_of_his_edit_list_on_his_track(library, weaving_player):
    (take,) = construct_player(library, weaving_player, 0.0, 100.0)
    clip, frame = weaving_player.stretches[0].edit.frames()
    names = [(take.clips[c], bool(m)) for c, m in zip(take.clip, take.mirrored)]
    table = weaving_player.stretches[0].edit.clips
    assert np.mean([name == table[c] for name, c in zip(names, clip)]) > 0.99
    track = sample_track(weaving_player.stretches[0].plan.track, 30.0)
    assert np.abs(take.motion.root_positions[:, :2] - track.positions).max() < 0.35
    assert take.keys[0].frame == pytest.approx((KICK_TIME - 5.0) * 30.0, abs=1.0)


def test_two_windows_meet_without_a_jump(library, weaving_player):
    (take,) = construct_player(library, weaving_player, 5.0, 30.0)
    places, _ = forward_kinematics(take.motion)
    jerk = np.linalg.norm(np.diff(places, 3, axis=0), axis=-1).max(axis=1)
    near = np.zeros(len(jerk), bool)
    for edge in (8.0, 16.0, 24.0):
        at = int(round((edge - take.start_time) * 30.0))
        near[at - 3 : at + 63] = True
    assert jerk[near].max() <= 1.2 * jerk[~near].max()


def test_an_exhausted_player_breathes_on_through_windows(library, weaving_player):
    """Chest and shoulders go alike in windows of 8 s and in one, where the player has recovered for a while."""
    (stretch,), chest = weaving_player.stretches, identify_joints(library.skeleton).chest

    def measure_turn(window):
        """(T, 3) rotation vectors by which the chest is turned otherwise than that of a rested player."""
        stretches = [replace(stretch, plan=replace(stretch.plan, fatigue=share, exertion=6.0)) for share in (0.0, 1.0)]
        takes = [construct_player(library, replace(weaving_player, window=window, stretches=(one,)), 5.0, 30.0)[0]
                 for one in stretches]
        rested, tired = (forward_kinematics(take.motion)[1][:, chest] for take in takes)
        return quaternion.to_rotation_vector(quaternion.multiply(tired, quaternion.inverse(rested)))

    cut, whole = measure_turn(8.0), measure_turn(60.0)
    assert np.degrees(np.linalg.norm(whole, axis=1)).max() > 3.0
    assert np.degrees(np.linalg.norm(cut - whole, axis=1)).max() < 0.5


def test_one_window_is_what_synthesize_makes(library, weaving_plan):
    take = synthesize(library, weaving_plan)
    again = construct_take(library.with_synthetic_clips, resolve_plan(weaving_plan, library), take.edit)
    assert np.allclose(again.motion.root_positions, take.motion.root_positions, rtol=0.0, atol=1e-9)
    assert (again.keys[0].clip, again.words, again.timeline) == (take.keys[0].clip, take.words, take.timeline)


def test_what_gave_way_is_told_by_the_report_and_not_by_every_window(library, weaving_player):
    (take,) = construct_player(library, weaving_player, 5.0, 30.0)
    told = report_unmet_constraints(playback_from_take(take), track=take.plan.track, timeline=take.timeline,
                                    library=library)
    kinds = {re.sub(r"[\d., -]+", "", line) for line in told}
    assert kinds and not kinds & {re.sub(r"[\d., -]+", "", line) for line in take.warnings}


def test_nothing_of_a_player_who_is_not_there(library, weaving_player):
    assert construct_player(library, weaving_player, 40.0, 50.0) == ()


def test_a_span_that_ends_before_it_starts_is_told(library, weaving_player):
    with pytest.raises(InputError, match="an end after the start"):
        construct_player(library, weaving_player, 20.0, 10.0)


def test_another_library_is_told(library, weaving_player):
    other = replace(library, clips=tuple(replace(clip, path=f"other/{clip.path}") for clip in library.clips))
    with pytest.raises(InputError, match="the library of this match"):
        construct_player(other, weaving_player, 5.0, 10.0)
