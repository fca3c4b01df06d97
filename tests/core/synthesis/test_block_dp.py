"""The cheapest sequence is found, whatever the costs mean."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.synthesis.search.blocks import find_cheapest_path

COSTS = st.integers(-9, 9)


@st.composite
def tables(draw):
    """Unary costs of one to four slots with one to four choices, some forbidden, and transition costs between them."""
    sizes = draw(st.lists(st.integers(1, 4), min_size=1, max_size=4))
    unary = [np.array(draw(st.lists(COSTS, min_size=n, max_size=n)), float) for n in sizes]
    for costs in unary:
        forbidden = draw(st.lists(st.booleans(), min_size=len(costs), max_size=len(costs)))
        if not all(forbidden):
            costs[np.array(forbidden)] = np.inf
    between = [
        np.array(draw(st.lists(COSTS, min_size=a * b, max_size=a * b)), float).reshape(a, b)
        for a, b in zip(sizes, sizes[1:])
    ]
    return unary, between


def cost_of(choice, unary, between):
    return sum(costs[c] for costs, c in zip(unary, choice)) + sum(
        t[a, b] for t, a, b in zip(between, choice, choice[1:])
    )


@settings(max_examples=150, deadline=None)
@given(tables())
def test_no_sequence_is_cheaper(table):
    unary, between = table
    choice, total = find_cheapest_path(unary, lambda slot: between[slot])
    assert total == cost_of(choice, unary, between)
    assert total == min(cost_of(c, unary, between) for c in itertools.product(*(range(len(u)) for u in unary)))


def test_one_slot_and_ties_go_to_the_first():
    choice, total = find_cheapest_path([np.array([2.0, 1.0, 1.0])], lambda slot: 1 / 0)
    assert (choice.tolist(), total) == ([1], 1.0)
    choice, _ = find_cheapest_path([np.zeros(3), np.zeros(3)], lambda slot: np.zeros((3, 3)))
    assert choice.tolist() == [0, 0]


def test_costs_are_asked_for_once_per_gap_and_left_alone():
    unary, asked = [np.array([1.0, 0.0])] * 4, []

    def between(slot):
        asked.append(slot)
        return np.eye(2)

    find_cheapest_path(unary, between)
    assert asked == [0, 1, 2]
    assert [u.tolist() for u in unary] == [[1.0, 0.0]] * 4


def test_a_transition_worth_avoiding_outweighs_a_cheap_choice():
    unary = [np.array([0.0, 1.0]), np.array([0.0, 0.0]), np.array([0.0, 5.0])]
    between = [np.array([[9.0, 9.0], [0.0, 9.0]]), np.array([[0.0, 0.0], [0.0, 0.0]])]
    assert find_cheapest_path(unary, lambda slot: between[slot])[0].tolist() == [1, 0, 0]


def test_the_docstring_example():
    choice, total = find_cheapest_path([np.array([0, 1.0]), np.array([5.0, 0])], lambda s: np.zeros((2, 2)))
    assert (choice.tolist(), total) == ([0, 1], 0.0)


def test_infinity_everywhere_is_visible_in_the_cost():
    assert find_cheapest_path([np.full(2, np.inf)], lambda slot: None)[1] == pytest.approx(np.inf)
