"""The grid of slots, and the pieces that serve key moments in it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.synthesis.search.request import compute_needed_frames, library_frame
from beyond_mocap.synthesis.search.slots import KEY_PLAYBACK_RATES, build_key_pieces, build_slot_edges, find_slot


@settings(deadline=None, max_examples=30)
@given(st.lists(st.floats(0, 8), min_size=0, max_size=5, unique=True))
def test_pieces_stay_between_their_neighbours_and_are_on_time(library, order, times):
    asked = order(*((time, "kick") for time in sorted(times)))
    edges = build_slot_edges(library, asked)
    assert edges[0] == 0 and edges[-1] == len(asked) and np.all(np.diff(edges) > 0)
    pieces = build_key_pieces(library, asked, edges)
    reached = 0
    for number in np.unique(pieces.number):
        own = pieces.number == number
        here = find_slot(edges, asked.keys[number].frame)
        assert np.all((pieces.first[own] <= here) & (here < pieces.end[own]))
        assert pieces.first[own].min() >= reached
        reached = pieces.end[own].max()
        for piece in np.flatnonzero(own):
            at = pieces.start[piece] + pieces.rate[piece] * (asked.keys[number].frame - edges[pieces.first[piece]])
            assert at == pytest.approx(library_frame(library, pieces.key(asked, piece)))


def test_a_lone_key_moment_gets_the_entry_and_exit_of_each_clip(library, order):
    asked = order((4.0, "kick"))
    edges = build_slot_edges(library, asked)
    pieces = build_key_pieces(library, asked, edges)
    assert len(pieces.number) == len(asked.keys[0].choices) * len(KEY_PLAYBACK_RATES)
    for piece in range(len(pieces.number)):
        entry, leave = np.array(compute_needed_frames(library, pieces.key(asked, piece))) / pieces.rate[piece]
        assert edges[pieces.first[piece]] <= asked.keys[0].frame - entry + 3.0
        assert edges[pieces.end[piece]] >= asked.keys[0].frame + leave - 3.0


def test_without_key_moments_slots_are_even(library, order):
    assert set(np.diff(build_slot_edges(library, order()))) <= {7, 8, 9}
