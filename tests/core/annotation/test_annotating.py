"""Annotating by keys: sequences of presses, and what they are to do."""

import pytest

from beyond_mocap.annotation.decision import LibraryCombinations
from beyond_mocap.annotation.key_commands import (
    KEYS,
    AddMoment,
    AddSpan,
    AnnotationState,
    ChangeAtPlayhead,
    GoToNeighbour,
    Playhead,
    ShowMessage,
    StopAnnotating,
    handle_key,
    select_label,
)


def typed(keys, state=AnnotationState(), times=None, before=None):
    """The state and all commands after these keys, at these times of the playhead (0.1 s apart where not given)."""
    commands = []
    for number, key in enumerate(keys):
        time = times[number] if times else 9.7 + 0.1 * number
        state, done = handle_key(state, key, Playhead(time, 0.04, before))
        commands += done
    return state, commands


def test_a_kick_is_at_the_time_of_its_first_key():
    state, commands = typed(["2", "2", "3", "5", "ENTER"])
    assert commands == [AddMoment(9.7, ("kick", "right", "low", "top"))]
    assert not state.trail and state.start is None and state.page == 0


def test_the_first_key_counts_even_if_it_turns_the_page_or_skips():
    assert typed(["NEXT_PAGE", "2", "ENTER"])[1] == [AddMoment(9.7, ("catchb",))]
    assert typed(["0", "NEXT_PAGE", "8", "ENTER"])[1] == [AddMoment(9.7, ("middle",))]


def test_in_and_out_and_words_make_a_stretch():
    state, commands = typed(["IN", "OUT", "NEXT_PAGE", "2", "2", "ENTER"], times=[3.0, 5.0, 6, 7, 8, 9])
    assert commands == [AddSpan(3.0, 5.0, ("dribble", "right"))]
    assert state.start is None and state.end is None


def test_out_before_in_is_the_other_way_round():
    _, commands = typed(["IN", "OUT", "2", "ENTER"], times=[5.0, 3.0, 6, 7])
    assert commands == [AddSpan(3.0, 5.0, ("walking",))]


def test_out_alone_begins_where_the_last_thing_ended():
    assert typed(["OUT", "2", "ENTER"], before=9.0)[1] == [AddSpan(9.0, 9.7, ("walking",))]
    state, commands = typed(["OUT"])
    assert isinstance(commands[0], ShowMessage) and state == AnnotationState()
    assert isinstance(typed(["IN", "OUT"], times=[3.0, 3.01])[1][0], ShowMessage)


def test_back_takes_one_word_and_then_closes_the_menu():
    assert typed(["2", "3", "BACK", "4", "ENTER"])[1] == [AddMoment(9.7, ("kick", "high"))]
    assert typed(["2", "BACK"])[0].trail and not typed(["2", "BACK", "BACK"])[0].trail
    assert typed(["2", "NEXT_PAGE", "BACK"])[0].page == 0


def test_escape_closes_the_menu_then_the_in_point_then_leaves():
    state, commands = typed(["IN", "2", "ESC"])
    assert not state.trail and state.start == 9.7 and commands == []
    state, commands = typed(["ESC"], state)
    assert state.start is None and commands == []
    assert typed(["ESC"], state)[1] == [StopAnnotating()]


def test_enter_without_words_does_nothing():
    state, commands = typed(["IN", "OUT", "ENTER"])
    assert commands == [] and not state.trail and state.start == 9.7


def test_another_key_accepts_what_was_chosen_first():
    assert typed(["2", "NEXT"])[1] == [AddMoment(9.7, ("kick",)), GoToNeighbour("moment", 1)]
    state, commands = typed(["2", "IN"])
    assert commands == [AddMoment(9.7, ("kick",))] and state.start == pytest.approx(9.8)


def test_an_in_point_survives_a_moment_within_the_stretch():
    _, commands = typed(["IN", "2", "ENTER", "OUT", "2", "ENTER"], times=[1, 2, 2, 3, 3, 3])
    assert commands == [AddMoment(2, ("kick",)), AddSpan(1, 3, ("walking",))]


def test_mirror_swaps_the_words_that_are_being_chosen_else_those_at_the_playhead():
    assert typed(["2", "2", "MIRROR", "ENTER"])[1] == [AddMoment(9.7, ("kick", "left"))]
    assert typed(["MIRROR"])[1] == [ChangeAtPlayhead("mirror")]


def test_nudging_moves_the_moment_that_is_being_named_else_the_one_at_the_playhead():
    state, commands = typed(["2", "LATER", "LATER", "EARLIER", "ENTER"])
    assert commands[0].time == pytest.approx(9.74)
    assert typed(["EARLIER", "LATER"])[1] == [ChangeAtPlayhead("earlier"), ChangeAtPlayhead("later")]


def test_remove_gives_up_the_words_else_removes_what_is_at_the_playhead():
    assert typed(["2", "REMOVE"]) == (AnnotationState(time=9.7), [])
    assert typed(["REMOVE"])[1] == [ChangeAtPlayhead("remove")]


def test_another_player_forgets_the_in_point():
    state, commands = typed(["IN", "NEXT_PLAYER"])
    assert state.start is None and commands == [GoToNeighbour("player", 1)]


def test_a_digit_without_a_word_and_an_unknown_key_do_nothing():
    assert typed(["4", "2", "6"]) == typed(["4", "2"])
    assert typed(["TAB"]) == (AnnotationState(), [])


def test_a_word_that_the_library_lacks_can_still_be_chosen():
    state = AnnotationState(LibraryCombinations((frozenset({"jump"}),), ()))
    assert typed(["2", "ENTER"], state)[1] == [AddMoment(9.7, ("kick",))]
    shown = {option.word: option.is_available for option in state.page_options}
    assert shown["jump"] and not shown["kick"]


def test_the_mouse_picks_as_the_digit_does():
    assert select_label(AnnotationState(), "kick", Playhead(9.7))[0] == typed(["2"])[0]


def test_pages_go_round():
    state, _ = typed(["NEXT_PAGE"])
    assert (state.page, state.page_count) == (1, 3)
    assert typed(["NEXT_PAGE", "NEXT_PAGE"], state)[0].page == typed(["PREVIOUS_PAGE"], state)[0].page == 0


def test_every_key_of_the_table_is_understood_in_every_state():
    for before in ([], ["2"], ["IN"], ["IN", "OUT"]):
        for key in (*KEYS, *"0123456789"):
            handle_key(typed(before)[0], key, Playhead(1.0))
