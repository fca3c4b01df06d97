"""Found touches against read ones: what is right, missed, false and doubtful, by hand."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.ball_touches import AnnotatedTouch, TouchAnnotation, read_touches, score_touches, score_with_offset
from beyond_mocap.base.errors import InputError

READ = TouchAnnotation(
    ((10.0, 20.0), (40.0, 50.0)), (AnnotatedTouch(12.0, ("a",)), AnnotatedTouch(13.0, ("a", "b")), AnnotatedTouch(15.0),
                                   AnnotatedTouch(45.0, ("c",))), (AnnotatedTouch(17.0, ("a",), 18.0),),
)


def test_a_touch_is_right_within_the_tolerance_and_by_the_right_player():
    score = score_touches([12.09, 13.0, 15.11, 44.95], ["a", "b", "x", "d"], READ)
    assert score.right == ((0, 0), (1, 1))
    assert score.missed == (2, 3)
    assert score.false == (2, 3)
    np.testing.assert_allclose(score.errors, [0.09, 0.0], atol=1e-12)
    assert score.precision == score.recall == score.f1 == 0.5


def test_each_serves_once_and_most_are_paired():
    """The nearest pair alone (12.0 with 11.98) would leave the second read touch without one."""
    read = TouchAnnotation(((0.0, 20.0),), (AnnotatedTouch(12.0, ("a",)), AnnotatedTouch(11.93, ("a",))))
    score = score_touches([11.98, 12.08], ["a", "a"], read)
    assert sorted(score.right) == [(0, 1), (1, 0)]
    assert score_touches([11.98, 11.99, 12.0], ["a"] * 3, read).precision == pytest.approx(2 / 3)


def test_doubts_count_neither_way_but_only_for_their_players_and_stretches_end():
    score = score_touches([17.5, 17.6, 30.0, 18.05], ["a", "b", "a", "a"], READ)
    assert (score.doubtful, score.false) == ((0, 3), (1,))
    assert score.recall == 0.0
    assert READ.seconds == 20.0


def test_nothing_found_or_read_is_no_fault():
    assert score_touches([], [], READ).f1 == 0.0
    empty = score_touches([12.0], ["a"], TouchAnnotation(((10.0, 20.0),), ()))
    assert (empty.false, empty.f1) == ((0,), 0.0)


def test_one_offset_of_a_whole_file_is_found():
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(0.6, 3.0, 60)) + 10.0
    read = TouchAnnotation(((0.0, 300.0),), tuple(AnnotatedTouch(t, (f"p{i % 7}",)) for i, t in enumerate(times)))
    found = times + 2.37 + rng.normal(0.0, 0.02, 60)
    score = score_with_offset(found, [f"p{i % 7}" for i in range(60)], read)
    assert score.offset == pytest.approx(2.37, abs=0.06)
    assert score.f1 == 1.0


@pytest.mark.parametrize("name, least", [("touches_by_hand.csv", 70), ("touches_by_hand_later.csv", 15)])
def test_the_lists_read_by_hand_are_whole(name, least):
    for match in ("dutch", "nl2019"):
        reading = read_touches(Path(__file__).parents[3] / "benchmarks" / name, match)
        for touch in (*reading.touches, *reading.doubts):
            ends = [touch.time, touch.time if touch.until is None else touch.until]
            assert any(start <= ends[0] <= ends[1] <= end for start, end in reading.stretches), touch
        assert all(touch.players for touch in reading.touches)
        assert len(reading.touches) >= least


def test_bad_lists_are_told(tmp_path):
    path = tmp_path / "list.csv"
    path.write_text("match,time_s\nm,1\n")
    with pytest.raises(InputError, match="columns"):
        read_touches(path, "m")
    head = "match,row,time_s,until_s,player,part,word,note\n"
    path.write_text(head + "m,kick,1,,a,,,\n")
    with pytest.raises(InputError, match="kick"):
        read_touches(path, "m")
    path.write_text(head + "m,stretch,1,2,,,,\n")
    with pytest.raises(InputError, match="no stretch"):
        read_touches(path, "other")
