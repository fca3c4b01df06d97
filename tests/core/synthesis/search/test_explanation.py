"""Why a clip was chosen: the parts add up to what the search paid, and name what is planted."""

from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.annotation import read_timeline
from beyond_mocap.files.tracking.tracking import read_track_csv
from beyond_mocap.library.build import build_library
from beyond_mocap.motion.track import BALL_RADIUS, Track, clean_track
from beyond_mocap.synthesis.plan import Pin, Plan, PlayerTouch, SolvedTrajectory
from beyond_mocap.synthesis.resolve_plan import resolve_plan
from beyond_mocap.synthesis.search.blocks import BlockSearch
from beyond_mocap.synthesis.search.cost_weights import TERMS, Weights, balance_weights
from beyond_mocap.synthesis.search.distance import align_keys, build_straight_edit
from beyond_mocap.synthesis.search.explanation import explain_block_choices, explain_choices, explain_path_choices
from beyond_mocap.synthesis.search.path_search import PathSearch
from beyond_mocap.synthesis.synthesize import synthesize

DATA = Path(__file__).resolve().parents[5] / "shared" / "data"
RESOLVED = [
    {"height": 1.5}, {"height": 2.0}, {"solve_touches": False},
    {"height": 1.6, "pins": (Pin(2.0, "left_hand", (3.0, 0.3, 1.3)),), "solve_touches": True},
    {"height": 1.95, "style": ("jogging",), "style_weight": 2.0, "strong_foot": "left"},
]  # fmt: skip
LINES = [(), ((4.0, "kick"),), ((2.013, "kick right"), (6.0, "kick left")), ((3.0, 6.0, "running"),)]


@pytest.fixture
def paid(monkeypatch) -> list[float]:
    """What every search cost in all."""
    found, read = [], PathSearch._trace_path

    def noted(search, layers):
        found.append(float(layers[-1].cost.min()))
        return read(search, layers)

    monkeypatch.setattr(PathSearch, "_trace_path", noted)
    return found


@pytest.mark.parametrize("lines", LINES)
def test_the_parts_add_up_to_what_the_search_paid(library, order, paid, lines):
    asked = order(*lines)
    edit = PathSearch(library, asked).run()
    found = explain_path_choices(library, asked, edit, Weights(), others=0)
    assert sum(reason.cost for reason in found) == pytest.approx(paid[0], abs=2e-3)
    assert [(reason.first, reason.end) for reason in found] == edit.pieces


def test_a_key_moment_put_on_time_costs_what_the_search_paid(library, order, paid):
    asked = order((2.013, "kick right"))
    edit = align_keys(library, PathSearch(library, asked, balance_weights(0.5)).run(), asked)
    found = explain_path_choices(library, asked, edit, balance_weights(0.5), others=0)
    assert sum(reason.cost for reason in found) == pytest.approx(paid[0], abs=2e-3)


def test_a_missed_speed_is_the_dearest_part(library, order, track_of):
    asked = order(track=track_of(8.0))
    found = explain_path_choices(library, asked, PathSearch(library, asked).run(), Weights())
    assert {next(iter(reason.costs)) for reason in found} <= {"speed", "drag"}


def test_words_that_the_clip_lacks_are_told(library, order):
    asked = order((0.0, 8.0, "running"))  # at a walk
    edit = PathSearch(library, asked).run()
    found = explain_path_choices(library, asked, edit, Weights())
    lacking = [r for r in found if "running" not in library.clips[r.clip].labels_at(r.clip_range[0])]
    assert lacking and all(r.costs.get("words", 0.0) > 0.5 for r in lacking)


def test_others_are_other_clips_and_cost_what_they_cost(library, order):
    asked = order()
    found = explain_path_choices(library, asked, PathSearch(library, asked).run(), Weights())
    first = found[0]
    assert first.others and all((o.path, o.mirrored) != (first.path, first.mirrored) for o in first.others)
    assert [o.extra_cost for o in first.others] == sorted(o.extra_cost for o in first.others)


def test_parts_have_words(library, order):
    asked = order((4.0, "kick"))
    found = explain_path_choices(library, asked, PathSearch(library, asked).run(), Weights())
    assert {name for reason in found for name in (*reason.costs, *reason.cut_costs)} <= set(TERMS)


def test_blocks_tell_words_and_pose(library, order):
    asked = order((0.0, 8.0, "walking"))
    search = BlockSearch(library, asked, Plan.alpha)
    edit = build_straight_edit(search, search.run())
    found = explain_block_choices(library, asked, edit, Plan.alpha)
    assert [(reason.first, reason.end) for reason in found] == edit.pieces
    assert not found[0].cut_costs and all(reason.cut_costs["pose"] >= 0.0 for reason in found[1:] if reason.cut_costs)
    walking = [
        r for r in found if all("walking" in library.clips[r.clip].labels_at(f) for f in np.linspace(*r.clip_range, 9))
    ]
    assert walking and all(r.costs["words"] < 0.0 for r in walking)


def test_a_word_that_must_not_be_is_paid_for_and_told(library, track_of, paid):
    from beyond_mocap.annotation import parse_timeline
    from beyond_mocap.synthesis.search.request import build_request

    plan = Plan(track=track_of(), timeline=parse_timeline("0 8 -walking\n", "words", 30.0, 0.0))
    asked = build_request(library, resolve_plan(plan, library))
    search = PathSearch(library, asked)
    found = explain_path_choices(library, asked, search.run(), Weights(), others=0)
    assert sum(reason.cost for reason in found) == pytest.approx(paid[0], rel=1e-5, abs=2e-3)


def explained(library, plan, take) -> float:
    """What the pieces of a take cost in all, by what is said of them."""
    return sum(reason.cost for reason in explain_choices(library, resolve_plan(plan, library), take.edit))


@pytest.mark.parametrize("settings", RESOLVED, ids=lambda settings: " ".join(settings))
def test_what_is_explained_is_what_the_search_paid(library, track_of, timeline_of, paid, settings):
    way = track_of(2.8, seconds=10.0)
    at, ball = 5.06, np.column_stack([way.positions + [0.4, 0.0], np.full(len(way), BALL_RADIUS)])
    course = SolvedTrajectory(way.times, ball, np.zeros(len(way), bool), (PlayerTouch(at, True, "foot", "kick"),))
    plan = Plan(Track(way.times, way.positions, ball), timeline_of((5.4, "kick right")), solved=course, **settings)
    take = synthesize(library, plan)
    assert explained(library, plan, take) == pytest.approx(paid[0], abs=2e-3)


@pytest.mark.skipif(not (DATA / "mocap" / "cmu10").is_dir(), reason="the recordings in ../shared/data are not here")
@pytest.mark.parametrize("settings", RESOLVED[3:], ids=lambda settings: " ".join(settings))
def test_recordings_are_explained_by_what_the_search_paid(recordings, paid, settings):
    scenario = DATA / "tracking" / "scenarios" / "scenario2"
    way, _ = clean_track(read_track_csv(f"{scenario}_track.csv"))
    plan = Plan(way, read_timeline(f"{scenario}_annotations.txt", 30.0), nearest=True, **settings)
    take = synthesize(recordings, plan)
    assert explained(recordings, plan, take) == pytest.approx(paid[0], rel=1e-4)


@pytest.fixture(scope="module")
def recordings(recordings_cache):
    return build_library(DATA / "mocap" / "cmu10", unit=0.05644, cache_dir=recordings_cache)
