"""The decision tree: digits that stay, levels that may be skipped, and what a planted library has."""

import pytest

from beyond_mocap.annotation import decision
from beyond_mocap.annotation.decision import (
    LibraryCombinations,
    TreeChoices,
    can_skip,
    choose_label,
    count_pages,
    find_alternative,
    is_available,
    list_options,
    skip_level,
)

KICK = frozenset("kick right low top running front".split())
JUMP = frozenset("jump high".split())
HELD = LibraryCombinations((KICK, frozenset("kick left low top running front".split()), JUMP),
                           (frozenset({"walking", "front"}), frozenset({"dribble", "jogging", "juggling"})))


def down(kind, *words):
    walk = TreeChoices(kind)
    for word in words:
        walk = skip_level(walk) if word == "0" else choose_label(walk, word)
    return walk


def digits(walk, held=None, page=0):
    return {option.word: option.digit for option in list_options(walk, held) if option.page == page}


def test_kick_right_low_top_is_four_presses():
    walk = TreeChoices("moment")
    pressed = []
    for word in ("kick", "right", "low", "top"):
        pressed.append(digits(walk)[word])
        walk = choose_label(walk, word)
    assert pressed == [2, 2, 3, 5]
    assert walk.words == ("kick", "right", "low", "top")


def test_roots_stand_in_the_trees_order_on_pages_of_nine():
    assert digits(TreeChoices("moment")) == dict(zip(
        ("receive", "kick", "throwb", "header", "scissors", "getting_up", "fall", "fly", "jump"), range(1, 10)))
    assert list(digits(TreeChoices("moment"), page=1)) == [
        "intercept", "catchb", "stomp", "punt", "goal_kick", "block", "punch", "throwout", "rollout"]
    assert (count_pages(TreeChoices("moment")), count_pages(TreeChoices("span"))) == (3, 3)
    assert list(digits(TreeChoices("span"), page=1))[:4] == ["turning", "dribble", "shield", "jockey"]


@pytest.mark.parametrize(
    "way", [("kick",), ("kick", "right"), ("kick", "low"), ("kick", "0", "top"), ("catchb", "dive")]
)
def test_sides_and_paces_keep_their_digits_wherever_one_is(way):
    found = digits(down("moment", *way))
    assert (found["left"], found["right"], found["standing"], found["running"]) == (1, 2, 8, 9)


def test_a_side_may_come_at_any_depth_and_takes_the_other_ones_place():
    assert down("moment", "kick", "low", "left").words == ("kick", "left", "low")
    assert down("moment", "kick", "left", "low", "right").words == ("kick", "right", "low")
    assert down("moment", "kick", "left", "left").words == ("kick",)
    assert digits(down("moment", "kick", "left"))["low"] == digits(down("moment", "kick"))["low"]


def test_a_skipped_level_offers_what_is_below_all_of_it():
    walk = down("moment", "kick", "0")
    below = [word for word, digit in digits(walk).items() if 3 <= digit <= 7]
    assert below == ["inside", "outside", "top", "volley", "half"]
    assert choose_label(walk, "top").words == ("kick", "top")
    deepest = down("moment", "kick", "low", "top")
    assert skip_level(deepest) == skip_level(skip_level(deepest)) and not can_skip(skip_level(deepest))


def test_the_first_level_can_be_skipped_too():
    walk = down("moment", "0")
    slide = next(option for option in list_options(walk) if option.word == "slide")
    assert choose_label(walk, "slide").words == ("slide",) and slide.page == 2


def test_words_with_a_digit_of_their_own_still_lead_down():
    assert digits(down("moment", "header", "running"))["jump"] == 3
    assert set(down("moment", "header", "running", "jump").words) == {"header", "running", "jump"}


def test_more_words_than_room_go_on_on_the_next_page_and_none_is_lost():
    found = list_options(down("moment", "intercept"))
    words = [option.word for option in found]
    assert len(set(words)) == len(words)
    assert {"slide", "knee", "inside", "outside", "short_duration", "long_duration", "subtle"} <= set(words)
    assert next(o for o in found if o.word == "long_duration").page == 1


def test_what_the_library_lacks_is_told_with_the_nearest_it_has():
    found = {option.word: option for option in list_options(down("moment", "kick", "right"), HELD)}
    assert found["low"].is_available and found["low"].alternative == ()
    assert not found["high"].is_available
    assert frozenset(found["high"].alternative) == KICK
    assert {o.word for o in list_options(TreeChoices("moment"), HELD) if o.is_available} == {"kick", "jump"}


def test_digits_do_not_depend_on_the_library():
    ways = [("moment", way) for way in ((), ("kick",), ("kick", "right", "low"), ("intercept",))]
    for kind, way in [*ways, ("span", ()), ("span", ("dribble",)), ("span", ("celebration",))]:
        for page in range(4):
            bare, held = (digits(down(kind, *way), which, page) for which in (None, HELD))
            assert bare == {word: digit for word, digit in held.items() if word in bare}


def test_without_a_library_nothing_is_known_to_be_missing():
    assert all(option.is_available for option in list_options(down("moment", "kick"), None))
    assert is_available(down("moment", "fly", "slide"), None) and not is_available(down("moment", "fly", "slide"), HELD)


def test_an_empty_library_serves_nothing_and_offers_nothing():
    empty = LibraryCombinations((), ())
    assert all(not option.is_available and option.alternative == () for option in list_options(TreeChoices("moment"),
            empty))
    assert find_alternative(("kick",), "moment", empty) == ()


def test_what_shares_nothing_is_not_called_near():
    held = LibraryCombinations((frozenset({"throwb", "middle"}),), ())
    assert find_alternative(("scissors",), "moment", held) == ()
    assert find_alternative(("header",), "moment", LibraryCombinations((frozenset({"jump"}),), ())) == ("jump",)


def test_the_librarys_own_words_stand_behind_the_trees():
    assert list(digits(TreeChoices("span"), HELD, page=2))[-1] == "juggling"
    assert "juggling" in {option.word for option in list_options(down("span", "dribble"), HELD)}
    assert "juggling" not in {option.word for option in list_options(down("span", "walking"), HELD)}
    assert down("span", "juggling").words == ("juggling",)


def test_a_transition_stands_alone():
    assert list_options(down("span", "transition"), HELD) == () and count_pages(down("span", "transition")) == 1
    assert next(o for o in list_options(TreeChoices("span"), HELD) if o.word == "transition").is_available


def test_stretches_go_down_their_own_tree():
    assert down("span", "celebration", "arms", "inside").words == ("celebration", "arms", "inside")
    assert digits(down("span", "walking"))["back"] == 9
    assert down("span", "dribble", "right").words == ("dribble", "right")


def test_words_across_the_branches_can_be_said_too():
    found = {option.word: option for option in list_options(down("moment", "receive", "body"))}
    assert found["high"].page > 0 and "body" not in found and "receive" not in found
    assert set(down("moment", "receive", "body", "high").words) == {"receive", "body", "high"}


def test_chosen_words_are_marked():
    assert [o.word for o in list_options(down("moment", "kick", "right"), HELD) if o.is_chosen] == ["right"]


def every_walk(walk, depth=0):
    yield walk
    for word in decision._list_next_labels(walk):
        yield from every_walk(choose_label(walk, word), depth + 1)


@pytest.mark.parametrize("kind", ["moment", "span"])
def test_every_path_of_the_tree_can_be_walked_with_no_digit_twice(kind):
    for walk in every_walk(TreeChoices(kind)):
        found = list_options(walk, HELD)
        assert len({(o.page, o.digit) for o in found}) == len(found)
        assert set(decision._list_next_labels(walk)) <= {o.word for o in found}
        assert all(1 <= o.digit <= 9 for o in found)
