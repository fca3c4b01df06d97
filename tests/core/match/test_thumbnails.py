"""Pictures of a made match's players: the pose that he has at that second, nothing where he is not there."""

from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.appearance.picture import render_pose
from beyond_mocap.library.build import build_library
from beyond_mocap.match.displayed_motion import construct_displayed_player
from beyond_mocap.match.player_file import read_player
from beyond_mocap.match.player_motion import construct_player
from beyond_mocap.match.report.pictures import PICTURE_SIZE, build_thumbnail_renderer
from beyond_mocap.match.request import MatchRequest
from beyond_mocap.match.synthesize_match import synthesize_match

SAMPLE = Path(__file__).resolve().parents[3] / "sample_blend"


@pytest.fixture(scope="module")
def made(sample_cache, tmp_path_factory):
    """Four seconds of one player of the sample's match, and the library."""
    place = tmp_path_factory.mktemp("thumbnails")
    order = MatchRequest(
        tracking=SAMPLE / "match" / "small" / "small.dat", library=SAMPLE / "library", out=place / "made",
        cache=sample_cache, start=2.0, end=6.0, players=("home_1",), solve_touches=False, figures=False, workers=1,
    )  # fmt: skip
    assert synthesize_match(order).failed == ()
    return place / "made", build_library(order.library, cache_dir=order.cache)


def test_a_picture_is_the_pose_of_that_second(made):
    folder, library = made
    edit = read_player(folder / "home_1.take.npz")
    take = construct_displayed_player(library, edit, None, 2.0, 6.0)[0]
    draw = build_thumbnail_renderer(library, folder)
    draw_stored = build_thumbnail_renderer(library, folder, lambda _, *span: construct_player(library, edit, *span))
    for second in (2.5, 4.0):
        frame = round((second - take.start_time) * take.motion.fps)
        near = range(frame - 15, frame + 16, 5)  # a keeper who stands moves little in less
        picture = draw("home_1", second)
        assert np.array_equal(picture, draw_stored("home_1", second))
        off = [np.abs(picture - render_pose(take.motion, one, PICTURE_SIZE)).mean() for one in near]
        assert near[int(np.argmin(off))] == frame and min(off) < 0.25 * np.median(off)


def test_there_is_none_where_he_is_not_or_his_file_is_broken(made):
    folder, library = made
    draw = build_thumbnail_renderer(library, folder)
    assert draw("home_1", 30.0) is None
    (folder / "home_1.take.npz").write_bytes(b"none")
    assert draw("home_1", 2.5) is None
