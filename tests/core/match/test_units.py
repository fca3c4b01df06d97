"""A plan in windows: their place on the clock, and that a cut plan asks for what the whole one does."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.annotation import KeyMoment, Span, Timeline
from beyond_mocap.base.errors import InputError, UserCancelledError
from beyond_mocap.library.missing_actions import describe_action
from beyond_mocap.match.pieces.units import build_units, build_window_edges, count_frames, cut_plan, cut_track
from beyond_mocap.match.pieces.windows import join_pieces, search_window
from beyond_mocap.match.player_edit import to_stored_plan
from beyond_mocap.match.player_motion import construct_player
from beyond_mocap.motion.track import Track, sample_track
from beyond_mocap.synthesis.plan import Plan, PlayerTouch, SolvedTrajectory
from beyond_mocap.synthesis.search.candidate_index import SLOT

HEADER_TIME = 20.5


@given(st.floats(0.0, 500.0), st.integers(60, 20000), st.sampled_from([10.0, 30.0, 60.0]))
def test_windows_follow_each_other_and_lie_on_the_clock(begin, count, window):
    edges = build_window_edges(begin, count, window)
    assert edges[0] == 0 and edges[-1] == count and np.all(np.diff(edges) > 0)
    for edge in edges[1:-1]:
        time = begin + edge / 30.0
        assert edge % SLOT == 0 and abs(time - window * round(time / window)) <= 0.5 * SLOT / 30.0 + 1e-6
    assert np.all(np.diff(edges) <= 1.6 * window * 30.0 + SLOT)


def test_a_part_of_a_stretch_is_laid_out_in_the_windows_of_the_whole():
    whole, part = build_window_edges(5.0, 6000, 30.0, step=1), build_window_edges(65.0, 1800, 30.0, step=1)
    assert {edge + 1800 for edge in part[1:-1]} <= set(whole)


def test_units_cover_a_stretch_and_share_their_overlaps(weaving_plan):
    units = build_units(weaving_plan, 3, window=8.0, overlap=3.0)
    assert [unit.number for unit in units] == list(range(len(units))) and len(units) == 4
    assert {(unit.player, unit.stretch) for unit in units} == {("home_7", 3)}
    assert [unit.own for unit in units[1:]] == [(a.own[1], b.own[1]) for a, b in zip(units, units[1:])]
    assert units[0].own[0] == 0 and units[-1].own[1] == count_frames(weaving_plan)
    for unit in units:
        assert unit.start == pytest.approx(5.0 + unit.own[0] / 30.0)
        assert unit.plan.track.times[0] == pytest.approx(5.0 + unit.first / 30.0, abs=1e-9)
        assert unit.first % SLOT == 0 and unit.first == max(0, unit.own[0] - 64)
    assert [len(unit.plan.timeline.keys) for unit in units] == [0, 0, 1, 0]


def test_a_unit_that_has_travelled_finds_the_same(library, weaving_plan, weaving_pieces):
    unit = build_units(weaving_plan, window=8.0, overlap=3.0)[2]
    piece = pickle.loads(pickle.dumps(search_window(library, pickle.loads(pickle.dumps(unit)))))
    same = weaving_pieces[2]
    assert (piece.first, piece.own, piece.warnings) == (same.first, same.own, same.warnings)
    assert piece.edit.clips == same.edit.clips
    assert all(np.array_equal(a, b) for a, b in zip(piece.edit.frames(), same.edit.frames()))
    assert piece.edit.keys == same.edit.keys and len(piece.edit.keys) == 1 and piece.seconds > 0.0
    assert len(piece.edit) == count_frames(unit.plan)


def test_a_search_that_is_cancelled_ends(library, weaving_plan):
    with pytest.raises(UserCancelledError):
        search_window(library, build_units(weaving_plan, window=8.0, overlap=3.0)[0], lambda: True)


def test_a_search_in_a_hurry_says_from_where_on(library, weaving_plan):
    unit = build_units(weaving_plan, window=8.0, overlap=3.0)[0]
    asked = iter([False] * 4 + [True] * 10000)
    piece = search_window(library, unit, hurry=lambda: next(asked))
    assert piece.hurried_from is not None and 0 < piece.hurried_from < len(piece.edit) == count_frames(unit.plan)


@pytest.mark.parametrize("window, overlap", [(2.0, 1.0), (60.0, 40.0), (60.0, 0.1)])
def test_windows_without_sense_are_told(weaving_plan, window, overlap):
    with pytest.raises(InputError):
        build_units(weaving_plan, window=window, overlap=overlap)


def test_a_cut_track_is_sampled_as_the_whole_one_away_from_its_ends(weaving_plan):
    whole = sample_track(weaving_plan.track, 30.0)
    part = sample_track(cut_track(weaving_plan.track, 5.0 + 100 / 30.0, 5.0 + 400 / 30.0), 30.0)
    inside = slice(60, -60)
    assert len(part) == 301
    assert np.allclose(part.times, whole.times[100:401]) and np.allclose(part.raw, whole.raw[100:401])
    assert np.allclose(part.positions[inside], whole.positions[100:401][inside], atol=1e-9)
    assert np.allclose(part.speed[inside], whole.speed[100:401][inside], atol=1e-9)


def test_between_samples_a_cut_says_no_more_than_its_neighbours():
    times, ball = np.array([0.0, 1.0, 2.0]), np.array([[0, 0, 0.11], [1, 0, np.nan], [2, 0, 0.11]])
    track = Track(times, np.column_stack([times, times]), ball, filled=[False, True, False])
    cut = cut_track(track, 0.5, 2.0)
    assert cut.times.tolist() == [0.5, 1.0, 2.0] and cut.positions[0].tolist() == [0.5, 0.5]
    assert cut.filled.tolist() == [True, True, False] and cut.ball_height_known.tolist() == [False, False, True]
    assert cut.ball[0, 0] == 0.5 and np.isnan(cut.ball[0, 2])


def test_a_cut_plan_keeps_what_reaches_into_it(weaving_plan):
    spans = (Span(5.0, 12.0, ("walking",)), Span(25.0, 30.0, ("jogging",)))
    keys = (KeyMoment(9.0, ("kick",)), KeyMoment(12.0, ("kick",)), KeyMoment(20.0, ("kick",)))
    plan = cut_plan(Plan(track=weaving_plan.track, timeline=Timeline(spans, keys)), 10.0, 20.0)
    assert plan.timeline == Timeline(spans[:1], keys[1:])


def test_a_cut_plan_goes_on_with_the_exertion_of_its_start():
    times = np.arange(0.0, 60.0, 0.04)
    ahead = np.cumsum(np.where(times < 10.0, 7.0, 1.0)) * 0.04
    plan = Plan(track=Track(times, np.column_stack([ahead, 0.0 * times])), fatigue=0.5)
    once = cut_plan(plan, 30.0, 50.0)
    assert 5.0 < once.exertion < 15.0
    assert cut_plan(once, 40.0, 50.0).exertion == pytest.approx(cut_plan(plan, 40.0, 50.0).exertion, rel=1e-3)
    assert cut_plan(replace(plan, fatigue=0.0), 30.0, 50.0).exertion == 0.0


def with_course(plan: Plan) -> Plan:
    times = np.arange(5.0, 30.0, 0.004)
    ball = np.column_stack([times, np.sin(times), 1.2 + np.sin(times)])
    ball[:100] = np.nan
    touches = (PlayerTouch(7.0, True, "foot", "kick"), PlayerTouch(20.45, None, "", "receive"))
    return Plan(track=plan.track, timeline=plan.timeline, solve_touches=True, nearest=True,
                solved=SolvedTrajectory(times, ball, times > 25.0, touches))  # fmt: skip


def test_what_is_kept_of_a_plan_is_kept_once_for_all(weaving_plan):
    once = to_stored_plan(with_course(weaving_plan))
    twice = to_stored_plan(once)
    assert np.array_equal(once.track.positions, twice.track.positions)
    assert np.array_equal(once.solved.times, twice.solved.times)
    assert np.array_equal(once.solved.ball, twice.solved.ball, equal_nan=True)
    assert once.timeline == twice.timeline


def test_a_kept_plan_is_a_millimetre_off_at_most(weaving_plan):
    plan = with_course(weaving_plan)
    short = to_stored_plan(plan)
    assert np.abs(short.track.positions - plan.track.positions).max() <= 0.000501
    at = np.linspace(6.0, 29.0, 500)
    assert np.abs(short.solved.interpolate(at)[0] - plan.solved.interpolate(at)[0]).max() <= 0.0012


@settings(max_examples=20)
@given(st.floats(6.0, 15.0), st.floats(1.0, 10.0))
def test_a_cut_course_is_the_same_where_it_is_needed(weaving_plan, start, length):
    plan = with_course(weaving_plan)
    cut = cut_plan(plan, start, start + length)
    at = np.linspace(start, start + length, 50)
    assert np.array_equal(cut.solved.interpolate(at)[0], plan.solved.interpolate(at)[0], equal_nan=True)


@pytest.fixture(scope="module")
def header_player(library, weaving_plan):
    plan = replace(weaving_plan, timeline=Timeline(keys=(KeyMoment(HEADER_TIME, ("header",)),)))
    pieces = [search_window(library, unit) for unit in build_units(plan, window=8.0, overlap=3.0)]
    return join_pieces(library, [plan], pieces, 8.0)[0]


def test_a_match_shows_a_missing_action_at_its_time(library, header_player):
    edit = header_player.stretches[0].edit
    (key,) = edit.keys
    assert key.time == HEADER_TIME and describe_action(edit.clips[key.clip][0]).endswith("header")
    (take,) = construct_player(library, header_player, HEADER_TIME - 2.0, HEADER_TIME + 2.0)
    shown = take.clips[take.clip[round((HEADER_TIME - take.start_time) * take.motion.fps)]]
    assert describe_action(shown) == describe_action(edit.clips[key.clip][0])
