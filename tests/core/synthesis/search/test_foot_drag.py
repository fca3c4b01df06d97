"""A clip that stands around its key moment, on a track that runs there, stops there, or stands."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.library.build import build_library
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resolve_plan import resolve_plan
from beyond_mocap.synthesis.search.foot_drag import report_left_out
from beyond_mocap.synthesis.search.path_search import PathSearch
from beyond_mocap.synthesis.search.request import build_request
from beyond_mocap.synthesis.search.slots import KEY_PLAYBACK_RATES
from beyond_mocap.synthesis.synthesize import synthesize

KEY, ENTRY = 4.0, 1.2
"""Seconds of the key moment in the track, and of the clip's entry and exit, in all of which both feet stand."""


@pytest.fixture(scope="module")
def with_header(tmp_path_factory, clip_file):
    folder = tmp_path_factory.mktemp("header")
    for name, speed, words in (("stand", 0.0, "standing"), ("walk", 1.4, "walking"), ("run", 4.5, "running")):
        clip_file(folder / f"{name}.bvh", speed, 5.0, words, seed=3)
    clip_file(folder / "header.bvh", 0.0, 4.0, None, seed=5)
    (folder / "header.txt").write_text(f"{2.0 - ENTRY:g} {2.0 + ENTRY:g} header standing\n2 header standing\n")
    return build_library(folder)


@pytest.fixture(scope="module")
def search(with_header, track_of, timeline_of):
    def make(speed):
        plan = Plan(track=track_of(speed), timeline=timeline_of((KEY, "header standing")))
        return PathSearch(with_header, build_request(with_header, resolve_plan(plan, with_header)))

    return make


def header_shown(search):
    """Seconds (first, last) around the key moment in which the header's clip is shown."""
    edit, library = search.run(), search.library
    shown = np.array([library.clips[clip].path == "header.bvh" for clip in edit.clip])
    at = round(KEY * library.fps)
    assert shown[at]
    low, high = next(piece for piece in edit.pieces if piece[0] <= at < piece[1])
    return edit, low / library.fps - KEY, high / library.fps - KEY


def test_who_runs_up_and_stops_keeps_running_and_plays_the_exit(search):
    looked = search(lambda t: np.where(t < KEY, 4.5, 0.0))
    edit, first, last = header_shown(looked)
    assert -0.6 < first < -0.2 and last > ENTRY - 0.15
    told = report_left_out(looked.library, looked.request, edit)
    assert len(told) == 1 and "entry of the clip for 'header standing' is left out" in told[0]


def test_who_stands_and_runs_off_plays_the_entry_and_runs(search):
    looked = search(lambda t: np.where(t < KEY, 0.0, 4.5))
    edit, first, last = header_shown(looked)
    assert first < 0.15 - ENTRY and 0.2 < last < 0.6
    told = report_left_out(looked.library, looked.request, edit)
    assert len(told) == 1 and "exit of the clip" in told[0]


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_who_stands_has_the_whole_clip_and_no_choice(search, speed):
    looked = search(speed)
    assert len(looked.pieces.number) == len(looked.request.keys[0].choices) * len(KEY_PLAYBACK_RATES)
    edit, first, last = header_shown(looked)
    assert first < 0.15 - ENTRY / 1.3 and last > ENTRY / 1.3 - 0.15
    assert report_left_out(looked.library, looked.request, edit) == []


@pytest.mark.parametrize("method", ["path", "distance"])
def test_only_a_search_that_leaves_it_out_says_so(with_header, track_of, timeline_of, method):
    """By distance, what another key moment leaves no room for is cut off whether it drags or not."""
    moments = ((KEY, "header standing"), (KEY + 0.4, "header standing"))
    track = track_of(lambda t: np.full(len(t), 4.5))
    take = synthesize(with_header, Plan(track=track, timeline=timeline_of(*moments), method=method, made=False))
    assert any("is left out" in line for line in take.warnings) == (method == "path")


def test_a_clip_that_is_shown_for_a_single_frame_says_nothing(search):
    looked = search(lambda t: np.where(t < KEY, 4.5, 0.0))
    at, edit = round(KEY * looked.library.fps), looked.run()
    crowded = replace(edit, transitions=np.union1d(edit.transitions, [at, at + 1]))
    assert report_left_out(looked.library, looked.request, crowded) == []
