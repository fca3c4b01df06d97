"""An action that no recording shows is the same in every window of a match, and in the player that is built of them."""

from dataclasses import replace

import pytest

from beyond_mocap.annotation import KeyMoment, Timeline
from beyond_mocap.library.missing_actions import describe_action
from beyond_mocap.match.pieces.units import build_units
from beyond_mocap.match.pieces.windows import join_pieces, search_window
from beyond_mocap.match.player_motion import construct_player

HEADER_TIME = 20.5


@pytest.fixture(scope="module")
def header_player(library, weaving_plan):
    plan = replace(weaving_plan, timeline=Timeline(keys=(KeyMoment(HEADER_TIME, ("header",)),)))
    pieces = [search_window(library, unit) for unit in build_units(plan, window=8.0, overlap=3.0)]
    return join_pieces(library, [plan], pieces, 8.0)[0]


def test_a_match_shows_a_missing_action_at_its_time(library, header_player):
    edit = header_player.stretches[0].edit
    (key,) = edit.keys
    assert key.time == HEADER_TIME and describe_action(edit.clips[key.clip][0]).endswith("header")
    (take,) = construct_player(library, header_player, HEADER_TIME - 2.0, HEADER_TIME + 2.0)
    shown = take.clips[take.clip[round((HEADER_TIME - take.start_time) * take.motion.fps)]]
    assert describe_action(shown) == describe_action(edit.clips[key.clip][0])
