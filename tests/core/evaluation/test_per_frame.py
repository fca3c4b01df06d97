"""Figures of every frame are those of the report, and footprints are where feet were planted."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation import KeyMoment, Timeline
from beyond_mocap.evaluation.per_frame import find_footprints, find_strikes, measure_per_frame
from beyond_mocap.evaluation.report import evaluate
from beyond_mocap.evaluation.view import View
from beyond_mocap.synthesis.quality.playback import playback_from_take


@pytest.fixture()
def view_of(library):
    """view_of(take, track=None) -> the view of a take from the made library."""
    return lambda take, track=None: View(playback_from_take(take), track, take.timeline, library)


@pytest.fixture()
def jog(cut):
    return cut(("jog.bvh", 0, 241))


def test_root_error_and_slide_are_the_reports(jog, library, track_of, view_of):
    track = track_of(jog, shift=(0.02, 0.0))
    figures, report = measure_per_frame(view_of(jog, track)), evaluate(jog, track, library)
    assert figures.root_error.mean() == pytest.approx(report["root_error_m"]["mean"], rel=1e-3)
    assert figures.root_error.mean() == pytest.approx(0.02, rel=0.1)
    assert 100 * np.nanmean(figures.slide) == pytest.approx(report["skate"]["contact_cm_s"], rel=1e-3)
    assert np.abs(figures.speed_gap).max() < 0.2
    assert np.isnan(figures.correction).all()


def test_a_planted_jolt_stands_out_where_it_is(jog, view_of):
    places = jog.motion.root_positions.copy()
    places[120:] += [0.0, 0.0, 0.15]
    figures = measure_per_frame(view_of(replace(jog, motion=replace(jog.motion, root_positions=places))))
    assert abs(int(np.nanargmax(figures.jerk)) - 120) <= 9 and np.nanmax(figures.jerk) > 2.0
    assert np.isnan(figures.root_error).all()


def test_every_stance_is_a_footprint_along_the_way(jog, view_of):
    found = find_footprints(view_of(jog))
    spans = [np.flatnonzero(np.diff(np.r_[0, jog.contacts[:, side].astype(int), 0])).reshape(-1, 2) for side in (0, 1)]
    assert len(found) == sum(np.sum(np.diff(span) >= 2) for span in spans)
    start, end = jog.motion.root_positions[[0, -1], :2]
    way = np.arctan2(*(end - start)[::-1])
    assert all(abs((print_.direction - way + np.pi) % (2 * np.pi) - np.pi) < 0.5 for print_ in found)
    assert {print_.side for print_ in found} == {0, 1} and all(print_.start < print_.end for print_ in found)


def test_a_dragged_stance_tells_its_slide(jog, view_of):
    first = find_footprints(view_of(jog))[2]
    low, high = (round((at - jog.start_time) * 30) for at in (first.start, first.end))
    places = jog.motion.root_positions.copy()
    places[low : high + 1, 0] += np.linspace(0.0, 0.1, high + 1 - low)
    dragged = find_footprints(view_of(replace(jog, motion=replace(jog.motion, root_positions=places))))
    same = next(p for p in dragged if (p.start, p.side) == (first.start, first.side))
    assert same.slide == pytest.approx(first.slide + 0.1, abs=0.03)


def test_a_strike_is_on_the_foot_and_its_gap_the_reports(cut, library, view_of, still_ball):
    asked = (KeyMoment(15.0, ("kick", "right")),)
    take = cut(("jog.bvh", 0, 241), requested=asked)
    foot = playback_from_take(take).feet[150, 1, 1]
    take = replace(take, ball=still_ball(take, foot + [0.0, -0.3, 0.0]), timeline=Timeline(keys=asked))
    only, = find_strikes(view_of(take))
    report = evaluate(take, None, library)["keys"][0]
    assert only.gap == pytest.approx(report["met_gap_m"], abs=1e-4) and only.time == pytest.approx(15.0)
    assert np.linalg.norm(only.ball - only.part) - 0.11 == pytest.approx(only.gap, abs=0.01)


def test_without_a_ball_the_strike_is_on_the_body(cut, view_of):
    only, = find_strikes(view_of(cut(("jog.bvh", 0, 241), requested=(KeyMoment(15.0, ("kick", "right")),))))
    assert only.ball is None and np.isnan(only.gap) and np.isfinite(only.part).all()
