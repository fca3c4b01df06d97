"""Descriptions for targets that nobody threw at: like the examples that are like them, in step."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.throws.networks.example import build_description
from beyond_mocap.throws.networks.plan import LaunchRequest, choose_examples, plan_motion
from tests.core.linear_throws import build_throw_examples


@pytest.fixture(scope="module")
def examples():
    return build_throw_examples()


@pytest.fixture(scope="module")
def launches(examples):
    return np.array([example.launch for example in examples])


def wish_of(example, launch, **changed):
    asked = LaunchRequest(speed=float(np.linalg.norm(launch)),
                          elevation=float(np.arctan2(launch[2], np.hypot(*launch[:2]))),
                          distance=float(example.impact[0]), height=float(example.impact[2]),
                          limb=example.limb)  # fmt: skip
    return replace(asked, **changed)


def test_what_an_example_does_is_planned_as_the_example_does_it(examples, launches):
    made = plan_motion(examples[:1], launches[:1], wish_of(examples[0], launches[0]))
    truth = build_description(examples[0])
    assert len(made.description) == len(truth) and abs(made.description.release - truth.release) < 1e-6
    assert np.abs(made.description.effectors - truth.effectors).max() < 1e-6
    assert np.abs(made.description.hands - truth.hands).max() < 1e-6
    assert abs(made.pace - 1.0) < 1e-9


def test_the_nearest_examples_count_most(examples, launches):
    chosen, weights = choose_examples(examples, launches, wish_of(examples[3], launches[3]))
    assert chosen[0] == 3 and weights[0] == weights.max() and np.isclose(weights.sum(), 1.0)
    assert np.all(np.diff(weights) <= 1e-12)
    _, other = choose_examples(examples, launches, wish_of(examples[3], launches[3]), seed=4)
    assert not np.allclose(weights, other) and np.isclose(other.sum(), 1.0)


def test_a_movement_counts_once_and_other_peoples_movements_are_not_blended(examples, launches):
    people = [replace(each, subject="ann" if n % 2 else "bob") for n, each in enumerate(examples)]
    twice = [*people, *(replace(each, release=each.release + 1.0) for each in people)]
    chosen, weights = choose_examples(twice, np.concatenate([launches, launches]), wish_of(examples[3], launches[3]))
    assert {twice[n].subject for n in chosen} == {"ann"} and np.isclose(weights.sum(), 1.0)
    assert len({id(twice[n].motion) for n in chosen}) == len(chosen)


def test_blends_keep_the_release_and_the_speed_of_the_hand(examples, launches):
    wish = wish_of(examples[2], 0.5 * (launches[2] + launches[5]))
    made = plan_motion(examples, launches, wish).description
    hand = made.effectors[:, made.limb]
    speed = np.linalg.norm(np.diff(hand, axis=0), axis=1) * made.fps
    own = [
        np.linalg.norm(np.diff(build_description(e).effectors[:, e.limb], axis=0), axis=1).max() * e.motion.fps
        for e in examples
    ]
    assert 0.85 * min(own) < speed.max() < 1.1 * max(own)
    assert abs(int(np.argmax(speed)) - made.release) < 3.0
    assert np.allclose(made.impact, [wish.distance, 0.0, wish.height])
    assert np.abs(np.linalg.det(made.hands) - 1.0).max() < 1e-9


def test_a_faster_wish_is_played_faster(examples, launches):
    fast = wish_of(examples[0], launches[0], speed=1.1 * float(np.linalg.norm(launches[0])))
    made = plan_motion(examples[:1], launches[:1], fast)
    assert abs(made.pace - 1.1) < 1e-9
    assert abs(made.description.release - examples[0].release / 1.1) < 1e-6
    far = plan_motion(examples[:1], launches[:1], replace(fast, speed=99.0))
    assert abs(far.pace - 1.15) < 1e-9  # recordings are not played faster than this


def test_a_limb_that_no_example_uses_is_refused(examples, launches):
    with pytest.raises(InputError, match="limb"):
        plan_motion(examples, launches, wish_of(examples[0], launches[0], limb=3))
