"""A plan in frames: what each frame asks for, and who can serve the key moments."""

import numpy as np
import pytest

from beyond_mocap.base.errors import NotInLibraryError, line_spans
from beyond_mocap.synthesis.search.request import compute_needed_frames, library_frame


def test_nothing_asked_is_locomotion_by_speed(order, track_of):
    found = order(track=track_of(lambda t: np.where(t < 4, 1.4, 4.8)))
    words = [set(w) for w in found.requested_labels]
    assert len(words) == len(found) == 8 * 30 + 1
    assert words[30] == {"walking"} and words[-20] == {"running"}
    assert 3.5 < found.timeline.spans[0].end < 4.5


def test_a_standing_player_stands(order, track_of):
    assert {frozenset(w) for w in order(track=track_of(0.0)).requested_labels} == {frozenset({"standing"})}


def test_words_of_spans_are_asked_where_they_stand(order):
    found = order((2, 4, "walking left"))
    assert found.requested_labels[75] == {"walking",
                                          "left"} and found.requested_labels[30] == {
        "walking"} == found.requested_labels[150]


def test_an_avoided_gait_gives_its_place_to_the_one_nearest_in_speed(order, track_of):
    found = order((2, 4, "-walking"))
    assert found.requested_labels[75] == {"jogging"} and found.requested_labels[30] == {
        "walking"} == found.requested_labels[150]
    assert found.list_avoided(0, 59) == frozenset() and found.list_avoided(50, 61) == {"walking"}
    assert order((2, 4, "walking")).avoided == ()


def test_a_key_moment_takes_no_clip_with_a_word_that_must_not_be(order, library):
    found = order((4.0, "kick -left"))
    assert [library.clips[key.clip].mirrored for key in found.keys[0].choices] == [False] and not found.warnings
    only = order((4.0, "kick left -inside"))
    assert only.keys[0].choices and "no clip for 'kick left' is -inside" in only.warnings[0]
    assert line_spans(only.warnings[0]) == ((only.keys[0].requested.time,) * 2,)


def test_a_transition_asks_for_nothing(order):
    found = order((2, 4, "transition"))
    assert found.requested_labels[75] is None and found.requested_labels[30] is not None


def test_a_key_moment_is_served_with_room_for_its_entry_and_exit(order, library, kick_seconds):
    key = order((4.0, "kick right")).keys[0]
    asked = order((4.0, "kick right")).requested_labels
    assert key.frame == 120.0 and [library.clips[k.clip].mirrored for k in key.choices] == [False]
    entry, leave = compute_needed_frames(library, key.choices[0])
    assert 10 < entry < 40 and 5 < leave < 40
    silent = [i for i, words in enumerate(asked) if words is None]
    assert silent == list(range(int(np.ceil(120 - entry)), int(120 + leave) + 1))


def test_words_of_a_branch_may_be_left_out(order):
    assert len(order((4.0, "kick")).keys[0].choices) == 2
    assert len(order((4.0, "kick low left")).keys[0].choices) == 1


def test_without_mirrors_only_the_recorded_side_serves(order):
    assert len(order((4.0, "kick"), mirror=False).keys[0].choices) == 1
    with pytest.raises(NotInLibraryError):
        order((4.0, "kick left"), mirror=False)


def test_what_the_library_lacks_is_told_with_what_it_has(order):
    with pytest.raises(NotInLibraryError, match=r"4 s.*'header'.*nearest: .*kick.*Nearest Labels") as told:
        order((4.0, "header"))
    assert "\n" not in str(told.value) and told.value.nearest and told.value.exit_status == 3


def test_the_nearest_is_used_and_told(order):
    found = order((4.0, "kick high"), nearest=True)
    assert found.keys[0].used_instead and "kick" in found.keys[0].used_instead and found.keys[0].choices
    assert any("kick high" in warning and "used instead" in warning for warning in found.warnings)


def test_where_nothing_is_near_locomotion_stands_in(order):
    found = order((4.0, "header"), nearest=True)
    assert found.keys[0].choices == () and found.keys[0].used_instead == ("walking",)
    assert found.requested_labels[120] == {"walking"}


@pytest.mark.parametrize("time, frame", [(0.0, 0.0), (8.0, 240.0), (8.04, 240.0), (-0.05, 0.0), (3.21, 96.3)])
def test_key_frames_lie_on_the_track(order, time, frame):
    assert order((time, "kick")).keys[0].frame == pytest.approx(frame)


def test_the_clock_is_the_track_s(order, track_of):
    found = order((104.0, "kick"), (101.0, 102.0, "jogging"), track=track_of(start=100.0))
    assert found.keys[0].frame == pytest.approx(120.0) and found.requested_labels[45] == {"jogging"}


def test_words_that_no_clip_carries_are_told(order):
    warnings = order((2, 4, "celebration")).warnings
    assert len(warnings) == 1 and "celebration" in warnings[0]
    assert order((2, 4, "transition")).warnings == ()


def test_a_key_s_place_among_the_frames(library):
    for key in library.keys:
        at = library_frame(library, key)
        assert library.frames.clip[int(at)] == key.clip
        assert np.interp(at, np.arange(len(library.frames)), library.frames.source) == pytest.approx(
            key.frame, abs=1e-6
        )


def test_the_nearest_synthetic_actions_are_told_too(order):
    with pytest.raises(NotInLibraryError, match="; synthetic: .*tackle slide.*; use one of these"):
        order((4.0, "tackle slide block"))


def test_a_key_moment_that_names_no_action_is_told(order):
    messages = [line for line in order((4.0, "low")).warnings if "names no action" in line]
    assert len(messages) == 1 and messages[0].startswith("4 s: 'low'")
    assert not any("names no action" in line for line in order((4.0, "kick")).warnings)
