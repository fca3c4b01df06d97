"""What labels mean comes from one table: a new label is a row. `test_label_names` sees that nothing else names them."""

import os
import pathlib
import shutil
import subprocess
import sys

import pytest

from beyond_mocap.annotation import VOCABULARY, labels
from beyond_mocap.annotation.ball_contact import choose_contact_labels, choose_part_by_height
from beyond_mocap.annotation.labels import find_label, list_gaits, list_labels
from beyond_mocap.base.errors import InputError

TOP = pathlib.Path(__file__).parents[3]
SIDE_POKE = "side_poke,side poke,kicks with the side of the foot,discrete,,foot,,sends,,low,,,low(running)\n"


def test_the_table_is_the_tree_of_the_appendix():
    dive = {"long_duration": {"low": {}}, "short_duration": {"high": {}, "low": {}}}
    assert VOCABULARY["discrete"]["catchb"]["dive"] == dive
    assert VOCABULARY["discrete"]["turning"] == {"dribble": {"letgo": {}}} and VOCABULARY["continuous"]["turning"] == {}
    assert list(VOCABULARY["modifier"]) == ["right", "left", "front", "back", "subtle", "with_setup"]


def test_labels_say_what_they_do_with_the_ball():
    assert find_label("receive").ball == "takes" and find_label("receive").part == "foot"
    assert find_label("catchb").both_hands and find_label("catchb").title == "Catch, Two Hands"
    assert find_label("throw_two").title == "Throw Two" and find_label("player's").title == "Player's"
    assert find_label("moonwalk").ball == find_label("moonwalk").part == ""
    assert list_labels(ball="carries") == ("dribble",)
    assert list_gaits() == ("standing", "walking", "jogging", "running", "sprinting")


@pytest.mark.parametrize(
    "row, found",
    [("kick,kick,strikes,discrete,,,,,,,,,", "is repeated"), (SIDE_POKE.replace("sends", "shoots"), "ball 'shoots'"),
     ("side_poke,side poke", "wrong columns")]
)  # fmt: skip
def test_a_wrong_row_is_reported_with_its_line(row, found, tmp_path, monkeypatch):
    table = tmp_path / "vocabulary.csv"
    table.write_text(labels.TABLE.read_text() + row)
    monkeypatch.setattr(labels, "TABLE", table)
    with pytest.raises(InputError, match=f"vocabulary.csv:{len(table.read_text().splitlines())}: .*{found}"):
        labels.read_labels.__wrapped__()


def test_a_new_label_is_one_row(tmp_path):
    """A copy of the core with one more row takes the label for a pass of the foot everywhere."""
    ignored = shutil.ignore_patterns("__pycache__", "*.npz")
    shutil.copytree(TOP / "beyond_mocap", tmp_path / "beyond_mocap", ignore=ignored)
    with open(tmp_path / "beyond_mocap/annotation/vocabulary.csv", "a") as table:
        table.write(SIDE_POKE)
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    told = subprocess.run([sys.executable, "-P", "-c", USES], env=env, capture_output=True, text=True)
    assert (told.returncode, told.stderr) == (0, "") and pathlib.Path(told.stdout.strip()).is_relative_to(tmp_path)


USES = """
import beyond_mocap
from beyond_mocap.synthesis import resolved_touches
from beyond_mocap.annotation import DISCRETE, KeyMoment, Timeline, check_timeline, list_labels_below
from beyond_mocap.annotation import parse_timeline, sort_labels
from beyond_mocap.annotation.ball_contact import build_surfaces, may_use_foot
from beyond_mocap.annotation.decision import TreeChoices, list_options
from beyond_mocap.passes.strike_choice import _NAMED, _rank_labels
from beyond_mocap.library.classify.examples import find_act
from beyond_mocap.library.keys import Key, select_nearest_keys
from beyond_mocap.annotation import ClipAnnotation
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.synthesis.plan import PlayerTouch

words = ("side_poke", "right")
timeline = parse_timeline("2.0 side_poke right low", "a.txt", 30.0)
check_timeline(timeline, known_labels=(), start=0.0, end=4.0, where="a.txt")
assert "side_poke" in DISCRETE and sort_labels(("low", "right", "side_poke")) == ("side_poke", "right", "low")
assert list_labels_below(("side_poke",)) == ("low",)
assert "side_poke" in {one.word for one in list_options(TreeChoices("moment"))}
assert [(one.part, one.side) for one in build_surfaces(build_adult_skeleton(), words)] == [("foot", "right")]
assert may_use_foot(frozenset(words)) and _rank_labels("foot", frozenset(words)) == _NAMED

kick, receive = PlayerTouch(2.2, True, "foot", "kick"), PlayerTouch(2.1, True, "foot", "receive")
moved = resolved_touches._match_touches(Timeline(keys=(KeyMoment(2.0, words),)), (receive, kick))
assert moved.keys[0].solved == 2.2
assert find_act(ClipAnnotation(0, 9, 5, words)) == "side_poke"
key = Key(0, 5.0, 0.0, 9.0, frozenset(("kick", "right")))
assert select_nearest_keys((key,), words) == (key,)
print(beyond_mocap.__file__)
"""


@pytest.mark.parametrize("height, part", [(0.11, "foot low"), (0.6, "foot high"), (0.9, "thigh"), (1.3, "body"),
                                          (1.75, "head"), (None, "")])
def test_the_balls_height_chooses_the_part_of_a_plain_receive(height, part):
    assert choose_part_by_height(("receive", "running"), height) == ("receive", "running", *part.split())
    for words in (("receive", "foot"), ("receive", "body"), ("receive", "low"), ("kick",), ("catchb",)):
        assert choose_part_by_height(words, height) == words


@pytest.mark.parametrize("played, requested, expected", [
    (("dribble", "jogging"), ("receive", "body", "high"), ("receive", "body", "high")),
    (("dribble", "jogging"), ("dribble",), ("dribble", "jogging")),
    (("jogging",), ("header",), ("header",)),
    (("kick", "right"), ("kick",), ("kick", "right")),
])
def test_a_dribble_that_plays_at_a_touch_does_not_say_which_part_meets_the_ball(played, requested, expected):
    assert choose_contact_labels(played, requested) == expected
