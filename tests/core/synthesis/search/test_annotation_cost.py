"""Eq. 18 against itself computed word by word and frame by frame."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.synthesis.search.block_costs import AnnotationCost

WORDS = ("jogging", "kick", "right", "walking")


def frames_with(rows) -> SimpleNamespace:
    """As much of the library's frames as the cost looks at: words (N, V) of a list of word sets."""

    class Rows(SimpleNamespace):
        def __len__(self):
            return len(self.words)

    return Rows(
        words=np.array([[word in row for word in WORDS] for row in rows], bool).reshape(-1, len(WORDS)),
        vocabulary=WORDS,
    )


def eq18(asked, carried) -> float:
    """As printed: over frames and words that either has, minus the mean of products of +1 and -1; where nothing is
    asked, nothing is counted."""
    products = []
    for a, m in zip(asked, carried):
        if a is not None:
            products += [(1 if word in a else -1) * (1 if word in m else -1) for word in a | m]
    return -sum(products) / len(products) if products else 0.0


SETS = st.frozensets(st.sampled_from(WORDS))
ASKED = st.none() | st.frozensets(st.sampled_from((*WORDS, "header")))


@settings(max_examples=200, deadline=None)
@given(st.lists(SETS, min_size=8, max_size=14), st.lists(ASKED, min_size=1, max_size=8), st.data())
def test_it_is_eq_18_of_each_block(rows, asked, data):
    cost = AnnotationCost(frames_with(rows))
    start = np.array(data.draw(st.lists(st.integers(0, len(rows) - len(asked)), min_size=1, max_size=4)))
    expected = [eq18(asked, rows[s : s + len(asked)]) for s in start]
    assert np.allclose(cost.compute_block_costs(start, asked), expected)


@pytest.mark.parametrize(
    "asked, carried, cost",
    [
        ({"walking"}, {"running"}, 1.0),  # frames A and C of §3.2.2: r is 2, and neither word is shared
        ({"running", "kick"}, {"running"}, 0.0),  # B and C: one shared, one not
        ({"walking"}, {"running", "kick"}, 1.0),
        ({"running", "kick"}, {"running", "kick"}, -1.0),
        ({"running"}, {"running", "kick"}, 0.0),  # words beyond the asked ones count against a clip
        (set(), {"running"}, 1.0),
        (set(), set(), 0.0),
    ],
)
def test_faustino_s_own_frames(asked, carried, cost):
    frames = SimpleNamespace(
        words=np.array([[w in carried for w in ("kick", "running", "walking")]]),
        vocabulary=("kick", "running", "walking"),
    )
    frames = type("Frames", (SimpleNamespace,), {"__len__": lambda self: len(self.words)})(**vars(frames))
    assert AnnotationCost(frames).compute_block_costs(np.array([0]), [frozenset(asked)]).tolist() == [cost]


def test_transitions_count_neither_way():
    cost = AnnotationCost(frames_with([{"walking"}] * 4))
    asked = [frozenset({"walking"}), None, None, None]
    assert cost.compute_block_costs(np.array([0]), asked).tolist() == [-1.0]
    assert cost.compute_block_costs(np.array([0]), [None] * 4).tolist() == [0.0]


def test_sums_and_counts_are_added_before_dividing():
    cost = AnnotationCost(frames_with([{"walking"}, {"jogging", "kick", "right"}]))
    # 1 word shared of 1, then 0 of 4: (1 - 4) / 5, not the mean of -1 and 1
    assert cost.compute_block_costs(np.array([0]), [frozenset({"walking"})] * 2).tolist() == [pytest.approx(3 / 5)]


def test_a_block_beyond_the_library_still_has_a_cost():
    cost = AnnotationCost(frames_with([{"walking"}] * 6))
    asked = [frozenset({"walking"})] * 8
    inside, beyond, before = cost.compute_block_costs(np.array([0, 4, -4]), asked)
    assert np.isfinite([inside, beyond, before]).all() and -1.0 <= inside <= min(beyond, before)


def test_missing_share(library):
    cost = AnnotationCost(library.frames)
    share = cost.compute_missing_share(frozenset({"walking", "left"}))
    carried = [library.clips[c].labels_at(s) for c, s in zip(library.frames.clip, library.frames.source)]
    assert np.allclose(share, [1 - len({"walking", "left"} & words) / 2 for words in carried])
    assert np.all(cost.compute_missing_share(frozenset({"header"})) == 1.0)
    assert np.all(cost.compute_missing_share(frozenset()) == 1.0)
