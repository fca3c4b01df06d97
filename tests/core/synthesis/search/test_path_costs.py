"""What the path search weighs, on the made library: each misfit costs, and what fits is free."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.synthesis.search.candidate_index import PLAYBACK_RATES, SLOT, STRIKE_COST
from beyond_mocap.synthesis.search.cost_weights import TERMS, Weights
from beyond_mocap.synthesis.search.path_costs import PathCosts
from beyond_mocap.synthesis.search.preferences import REUSE_COST, UsedStretch

NORMAL = int(np.flatnonzero(PLAYBACK_RATES == 1.0)[0])
NONE = Weights(**{name: 0.0 for name in vars(Weights())})


def frames_of(library, path, mirrored=False):
    clip = next(i for i, c in enumerate(library.clips) if c.path == path and c.mirrored == mirrored)
    first = library.frames.first[clip]
    return np.arange(first, first + library.frames.count[clip] - SLOT - 2)


def costs(library, asked, **weights):
    return PathCosts(library, asked, replace(NONE, **weights))


def misfit(found, frames):
    return found.compute_misfit(60, 60 + SLOT, np.full(len(frames), NORMAL), frames)


@pytest.mark.parametrize("path, speed", [("stand.bvh", 0.0), ("walk.bvh", 1.4), ("jog.bvh", 2.8), ("run.bvh", 5.0)])
def test_speed_costs_what_it_is_off(library, order, track_of, path, speed):
    frames = frames_of(library, path)
    missed = misfit(costs(library, order(track=track_of(1.4)), speed=1.0), frames)
    assert np.median(missed) == pytest.approx(abs(speed - 1.4), abs=0.15)


def test_whoever_stands_on_both_feet_is_dragged(library, order, track_of):
    found = costs(library, order(track=track_of(0.6)), drag=1.0)
    assert misfit(found, frames_of(library, "stand.bvh")).min() > 0.5
    assert misfit(found, frames_of(library, "walk.bvh")).max() < 0.3


def test_a_bow_to_the_other_side_costs(library, order, track_of):
    found = costs(library, order(track=track_of(1.4, turn=0.9)), turn=1.0)
    left, right = (
        np.median(misfit(found, frames_of(library, "bows/turn.bvh", mirrored))) for mirrored in (False, True)
    )
    assert left < 0.1 and right > 0.3


def test_words_that_lack_and_actions_that_nobody_asked_for_cost(library, order):
    asked = order((0.0, 8.0, "jogging"))
    lacking = costs(library, asked, words=1.0)
    assert np.all(misfit(lacking, frames_of(library, "walk.bvh")) == 1.0)
    assert not np.any(misfit(lacking, frames_of(library, "jog.bvh")))
    kick = next(key for key in library.keys if not library.clips[key.clip].mirrored)
    at = library.frames.first[kick.clip] + int(kick.frame * 30.0 / library.clips[kick.clip].motion.fps)
    unasked = misfit(costs(library, asked, unasked=1.0), np.array([at - SLOT, at]))
    assert np.all(unasked == STRIKE_COST)  # a kick without a ball is worse than other actions


def test_a_kick_that_is_slower_than_the_player_drags_the_plant_foot(library, order, track_of):
    key = next(key for key in library.keys if not library.clips[key.clip].mirrored)
    start = library.frames.first[key.clip] + key.frame * 30.0 / library.clips[key.clip].motion.fps - SLOT / 2
    dragged = []
    for speed in (2.0, 3.5, 5.0):
        found = costs(library, order(track=track_of(speed)), slide=1.0)
        cost = found.compute_key_misfit(60, 60 + SLOT, np.array([key.clip]), np.array([start]), np.ones(1))
        dragged.append(float(cost[0]))
    assert dragged[0] < 0.2 and dragged[1] > 0.5 and dragged[2] > 3.0 * dragged[1]


def test_a_cut_costs_what_the_standing_foot_would_jump(library, order):
    frames = frames_of(library, "walk.bvh")
    stands = library.feet_in_contact[frames]
    one = frames[stands[:, 0] & ~stands[:, 1]]
    found = costs(library, order()).cuts.measure_foot_jump(one[:, None], one)
    feet = library.frames.feet[one, :2]
    assert np.allclose(found, np.linalg.norm(feet[:, None] - feet, axis=-1), atol=1e-6)
    other = frames[~stands[:, 0] & stands[:, 1]]
    assert not np.any(costs(library, order()).cuts.measure_foot_jump(one[:, None], other))


def test_the_cheapest_are_the_cheapest(library, order, track_of):
    found = PathCosts(library, order(track=track_of(1.4)))
    number, frame, cost = found.find_cheapest(60, 68, 10**6, 20)
    every = np.indices(found.index.speed.shape).reshape(2, -1)
    whole = np.sort(found.compute_misfit(60, 68, *every))
    assert np.allclose(np.sort(cost), whole[:20], atol=1e-5)
    assert np.allclose(cost, found.compute_misfit(60, 68, number, frame), atol=1e-5)


def test_every_term_has_a_text_also_what_an_earlier_solution_showed(library, order):
    asked, clip = order((0.0, 8.0, "jogging")), np.array([0])
    found = PathCosts(library, asked, used=(UsedStretch(library.clips[0].path, False, 0.0, 30.0),))
    frame = library.frames.first[clip]
    terms = dict(found.iter_misfit_terms(60, 60 + SLOT, np.array([NORMAL]), frame))
    key_terms = dict(found.iter_key_terms(60, 60 + SLOT, clip, frame.astype(float), np.ones(1)))
    assert {*terms, *key_terms} <= set(TERMS)
    assert terms["reused"] == REUSE_COST == key_terms["reused"]
