"""The search over the whole track: whatever it weighs, it plays clips forward, on time, at the asked speed."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError, UserCancelledError
from beyond_mocap.library.build import build_library
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resolve_plan import resolve_plan
from beyond_mocap.synthesis.search.edit_list import SearchStretch
from beyond_mocap.synthesis.search.path_search import PathSearch
from beyond_mocap.synthesis.search.request import build_request


def found(library, asked):
    return PathSearch(library, asked).run()


def source_frame(library, edit, at):
    return np.interp(edit.frame[at], np.arange(len(library.frames)), library.frames.source)


@pytest.mark.parametrize(
    "lines", [(), ((4.0, "kick"),), ((0.0, "kick"), (8.0, "kick left")), ((3.9, "kick"), (4.2, "kick left"))]
)
def test_every_frame_shows_a_clip_played_forward(library, order, lines):
    edit = found(library, order(*lines))
    assert len(edit) == 241
    for low, high in edit.pieces:
        assert len(set(edit.clip[low:high])) == 1
        steps = np.diff(edit.frame[low:high])
        assert np.all((steps > 0.6) & (steps < 1.5))


@pytest.mark.parametrize("time", [0.0, 0.5, 2.013, 4.0, 7.5, 8.0])
def test_a_key_moment_is_on_time(library, order, time):
    asked = order((time, "kick right"))
    edit = found(library, asked)
    assert [key.number for key in edit.keys] == [0]
    at = asked.keys[0].frame
    near = int(round(at))
    assert edit.clip[near] == edit.keys[0].key.clip
    step = edit.frame[near] + (at - near)
    assert np.interp(step, np.arange(len(library.frames)), library.frames.source) == pytest.approx(
        edit.keys[0].key.frame, abs=2.0
    )


@pytest.mark.parametrize("speed", [0.0, 1.4, 2.8, 5.0])
def test_the_clip_of_the_asked_speed_is_played(library, order, track_of, speed):
    edit = found(library, order(track=track_of(speed)))
    shown = library.frames.speed[np.clip(np.round(edit.frame).astype(int), 0, len(library.frames) - 1)]
    assert np.median(np.abs(shown - speed)) < 0.4


def test_where_the_feed_creeps_no_standing_body_glides(library, order, track_of):
    stands = library.stance_seconds
    assert stands[np.isin(library.frames.clip,
                          [i for i, c in enumerate(library.clips) if c.path == "stand.bvh"])].min() > 3
    walks = [i for i, c in enumerate(library.clips) if c.path == "walk.bvh"]
    assert stands[np.isin(library.frames.clip, walks)].max() < 1.0
    edit = found(library, order(track=track_of(0.6)))
    assert np.mean([library.clips[c].path == "stand.bvh" for c in edit.clip]) < 0.2


def test_a_turning_track_is_played_by_clips_that_turn(library, order, track_of):
    """Not all of the time: the one bow lasts 4 s, and is not shown again at once."""
    for turn, mirrored in ((0.9, False), (-0.9, True)):
        edit = found(library, order(track=track_of(1.4, turn=turn)))
        bows = [library.clips[c].mirrored for c in edit.clip if library.clips[c].path == "bows/turn.bvh"]
        assert len(bows) > 0.35 * len(edit) and set(bows) == {mirrored}


def test_without_mirrors_none_is_used(library, order, track_of):
    edit = found(library, order((4.0, "kick"), track=track_of(1.4, turn=-0.9), mirror=False))
    assert not any(library.clips[c].mirrored for c in set(edit.clip))


def test_the_same_order_gives_the_same_frames(library, order):
    a, b = (found(library, order((4.0, "kick"))) for _ in range(2))
    assert np.array_equal(a.frame, b.frame) and np.array_equal(a.clip, b.clip) and a.keys == b.keys


def test_it_can_be_stopped_and_tells_how_far_it_is(library, order):
    told = []
    PathSearch(library, order(), progress=lambda fraction, text: told.append(fraction)).run()
    assert told == sorted(told) and 0.0 <= told[0] and told[-1] <= 1.0
    with pytest.raises(UserCancelledError):
        PathSearch(library, order(), cancelled=lambda: True).run()


def test_a_stretch_is_searched_between_frames_that_stay(library, order):
    before = found(library, order((4.0, "kick right")))
    after = order((4.3, "kick right"))
    edit = PathSearch(library, after, stretch=SearchStretch(replace(before, keys=()), 60, 180)).run()
    outside = np.r_[0:60, 180:241]
    assert np.array_equal(edit.clip[outside], before.clip[outside])
    assert np.array_equal(edit.frame[outside], before.frame[outside])
    assert [seam for seam in edit.transitions if not 60 <= seam <= 180] == [s for s in before.transitions if not 60 <= s
                                                                            <= 180]
    key, = edit.keys
    near = int(round(after.keys[0].frame))
    assert edit.clip[near] == key.key.clip
    assert source_frame(library, edit, near) == pytest.approx(key.key.frame, abs=1.0)
    for low, high in edit.pieces:
        assert len(set(edit.clip[low:high])) == 1 and np.all(np.diff(edit.frame[low:high]) > 0.6)


def test_a_stretch_whose_order_is_the_same_is_joined_without_a_cut(library, order, track_of):
    """A steady walk, cut nowhere: what is shown goes on, so coming back to it costs nothing and leaving it does."""
    asked = order(track=track_of(1.4, seconds=4.0))
    before = found(library, asked)
    assert len(before.transitions) == 0
    edit = PathSearch(library, asked, stretch=SearchStretch(before, 40, 80)).run()
    assert len(edit.transitions) == 0 and np.allclose(edit.frame, before.frame)


def test_in_a_hurry_the_rest_is_searched_quickly(library, order):
    asked, told = order((6.0, "kick right")), []
    search = PathSearch(
        library, asked, progress=lambda fraction, text: told.append(fraction), hurry=lambda: len(told) > 9
    )
    edit = search.run()
    whole = found(library, asked)
    assert 70 < search.hurried_from < 100 and len(edit) == 241
    assert search.width.beam_width < 10
    assert [key.key.clip for key in edit.keys] == [key.key.clip for key in whole.keys]
    with pytest.raises(UserCancelledError):
        PathSearch(library, asked, hurry=lambda: True).run()


def test_clips_shorter_than_a_slot_are_told(tmp_path, clip_file, track_of):
    clip_file(tmp_path / "walk.bvh", 1.4, 0.2)
    library = build_library(tmp_path)
    with pytest.raises(InputError, match="no clip of more than 8 frames"):
        found(library, build_request(library, resolve_plan(Plan(track=track_of()), library)))


def test_a_narrow_search_is_one_hurried_from_its_second_slot_on(library, order):
    asked, questions = order((2.0, "kick right")), iter(range(10**6))
    narrow = PathSearch(library, asked, narrow=True)
    hurried = PathSearch(library, asked, hurry=lambda: next(questions) > 1)
    one, other = narrow.run(), hurried.run()
    assert narrow.hurried_from == hurried.hurried_from == narrow.edges[1]
    assert np.array_equal(one.frame, other.frame) and narrow.width == hurried.width
