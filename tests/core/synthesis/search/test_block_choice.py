"""Which blocks stay where a library has too many: those of the asked labels and speed, from many clips."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.synthesis.search.block_choice import choose_stretches, count_demands, rank_varied

WALK, RUN = frozenset({"walking"}), frozenset({"running"})


def planted(clips=12, blocks=40):
    """Clips of one speed each, 0.5 to 6 m/s; the slower half is labelled walking. Five stretches of eight a clip."""
    clip = np.repeat(np.arange(clips), blocks)
    speed = np.repeat(np.linspace(0.5, 6.0, clips), blocks)
    stretch = np.arange(clips * blocks) // 8
    cost = {WALK: np.where(clip < clips // 2, -1.0, 1.0), RUN: np.where(clip < clips // 2, 1.0, -1.0)}
    return clip, speed, stretch, cost


def test_each_asked_speed_has_its_share_by_frames():
    clip, speed, stretch, cost = planted()
    demands = count_demands([WALK] * 75 + [RUN] * 25, np.repeat([1.5, 5.0], [75, 25]))
    chosen = choose_stretches(demands, cost, speed, clip, stretch, 80)
    assert chosen.sum() == 80
    near = [int(np.sum(np.abs(speed[chosen] - wanted) < 0.6)) for wanted in (1.5, 5.0)]
    assert near == [64, 16]  # 60 and 20 in whole stretches of eight


def test_stretches_stay_whole_and_come_from_several_clips():
    clip, speed, stretch, cost = planted()
    chosen = choose_stretches({(WALK, 1.5): 100}, cost, speed, clip, stretch, 80)
    assert all(chosen[stretch == one].all() or not chosen[stretch == one].any() for one in np.unique(stretch))
    assert len(np.unique(clip[chosen])) >= 2
    alike = choose_stretches({(WALK, 1.5): 100}, cost, np.full(len(speed), 1.5), clip, stretch, 80)
    assert len(np.unique(clip[alike])) == 6  # all clips of walking are equally good


@settings(max_examples=60, deadline=None)
@given(st.integers(8, 600), st.lists(st.tuples(st.booleans(), st.floats(0.0, 9.0)), min_size=1, max_size=60))
def test_never_more_than_the_limit(limit, asked):
    clip, speed, stretch, cost = planted()
    demands = count_demands([WALK if is_walk else RUN for is_walk, _ in asked], np.array([v for _, v in asked]))
    chosen = choose_stretches(demands, cost, speed, clip, stretch, limit)
    assert 0 < chosen.sum() <= limit


def test_equally_good_ones_of_many_clips_come_before_many_of_one():
    order = rank_varied(np.zeros(9), np.repeat([0, 1, 2], 3))
    assert order.tolist() == [0, 3, 6, 1, 4, 7, 2, 5, 8]
    assert rank_varied(np.array([0.0, 0.0, 1.0]), np.array([0, 0, 1])).tolist() == [0, 1, 2]
