"""Which key moments can serve which words, and what stands in where none does."""

import numpy as np
import pytest

from beyond_mocap.annotation import ClipAnnotation, sort_labels
from beyond_mocap.library.clip import Clip
from beyond_mocap.library.keys import Key, collect_keys, list_nearest_labels, select_keys, select_nearest_keys
from beyond_mocap.synthetic.gait import build_gait


def key(words, clip=0):
    return Key(clip, 10.0, 5.0, 15.0, frozenset(words.split()))


LOW, TOP, VOLLEY, LEFT = (
    key("kick low inside right running"),
    key("kick high top right"),
    key("kick low volley right"),
    key("kick low inside left"),
)  # fmt: skip
KICKS = (LOW, TOP, VOLLEY, LEFT)


@pytest.mark.parametrize(
    "words, keys",
    [
        ("kick", KICKS),
        ("kick low", (LOW, VOLLEY, LEFT)),
        ("inside kick", (LOW, LEFT)),
        ("left kick", (LEFT,)),
        ("kick bicycle", ()),
        ("", KICKS),
    ],
)
def test_a_key_serves_when_it_carries_all_words(words, keys):
    assert select_keys(KICKS, words.split()) == keys


@pytest.mark.parametrize(
    "words, keys",
    [
        ("kick low outside right", (VOLLEY,)),  # as near as the others in what is shared, and with fewest words beyond
        ("kick high top left", (TOP,)),
        ("kick left running", (LEFT,)),
        ("dribble", (TOP, VOLLEY, LEFT)),
    ],
)
def test_the_nearest_shares_most_and_has_least_beyond(words, keys):
    found = select_nearest_keys(KICKS, words.split())
    assert set(keys) <= set(found) and len({len(set(words.split()) & k.labels) for k in found}) == 1


@pytest.mark.parametrize(
    "words",
    [
        "slide",
        "header",
        "right header",
        "running header",
        "receive body high",
        "jump slide right",
        "getting_up left",
        "throwb high",
        "running receive foot",
        "receive foot low inside",
        "trap",
    ],
)
def test_a_kick_is_no_answer_to_another_action(words):
    """Sharing a side, a pace or a height is not sharing the movement."""
    assert select_nearest_keys(KICKS, words.split()) == ()


def test_a_reception_and_a_strike_never_stand_for_each_other_but_a_dribble_may():
    trap, body, dribble = key("receive foot low inside right"), key("receive body"), key("dribble right")
    assert select_nearest_keys((trap, body), ["kick", "right"]) == ()
    assert select_nearest_keys((*KICKS, dribble), ["receive", "foot", "low"]) == (dribble,)
    assert select_nearest_keys((dribble, body), ["kick", "right"]) == (dribble,)
    assert select_nearest_keys((trap, body), ["receive", "high"]) == (body,)


def test_own_words_of_the_user_name_an_action_too():
    own = key("rabona right")
    assert select_nearest_keys((own, LOW), ["rabona", "left"]) == (own,)
    assert select_nearest_keys((own,), ["moonwalk"]) == ()


def test_an_empty_library_of_keys():
    assert select_keys((), ["kick"]) == select_nearest_keys((), ["kick"]) == () and list_nearest_labels((),
            ["kick"]) == ()


def test_nearest_words_are_offered_once_each():
    offered = list_nearest_labels((*KICKS, *KICKS), ["kick", "low", "left"], 3)
    assert offered[0].split() == list(sort_labels(LEFT.labels)) and len(set(offered)) == 3


def test_the_side_of_another_row_is_not_the_kick_s():
    """A right-footed kick while the body turns left: asked for a left kick, it must not answer."""
    rows = (
        ClipAnnotation(5, 15, 10, ("kick", "right", "low")),
        ClipAnnotation(8, 20, None, ("turning", "left")),
        ClipAnnotation(0, 20, None, ("walking", "front")),
    )
    motion = build_gait(1.4, 0.8, 30.0)
    clip = Clip(path="made.bvh", mirrored=False, motion=motion, annotations=rows,
                heel_toe_contacts=np.zeros((len(motion), 2, 2), bool))
    (found,) = collect_keys((clip,))
    assert found.labels == {"kick", "right", "low", "turning", "walking", "front"}


DIVES = (key("jump left high dive"), key("jump right high dive"))


@pytest.mark.parametrize(
    "words, keys",
    [
        ("catchb dive short_duration high left", (DIVES[0],)),
        ("stomp dive long_duration low right", (DIVES[1],)),
        ("catchb dive", DIVES),
        ("catchb high", ()),  # a catch that is no dive
        ("kick left", (LEFT,)),
    ],
)
def test_a_dive_stands_for_a_dive_whatever_the_hands_do(words, keys):
    assert select_nearest_keys((*KICKS, *DIVES), words.split()) == keys


def test_without_a_dive_nothing_stands_for_one_and_the_nearest_words_are_named():
    assert select_nearest_keys(KICKS, ["catchb", "dive", "left"]) == select_nearest_keys(KICKS, ["dive", "left"]) == ()
    assert list_nearest_labels(KICKS, ["dive", "left"])[0] == "kick left inside low"


def test_who_asks_for_a_jump_gets_no_dive_where_there_is_another():
    jump = key("jump")
    assert select_keys((*DIVES, jump), ["jump"]) == (jump,)
    assert select_keys(DIVES, ["jump"]) == DIVES
    assert select_keys((*DIVES, jump), ["dive"]) == DIVES
