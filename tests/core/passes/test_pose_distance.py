"""Eq. 1 of Ball handling for every frame of a library, as the path search weighs it."""

import numpy as np
import pytest

from beyond_mocap.passes.pose_distance import BONES, BoneWeights, align_poses, measure_bones, weigh_bones
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resolve_plan import resolve_plan
from beyond_mocap.synthesis.search.cost_weights import Weights
from beyond_mocap.synthesis.search.cut_costs import BoneDistance
from beyond_mocap.synthesis.search.path_costs import PathCosts
from beyond_mocap.synthesis.search.request import build_request


def pose_distance(a, b):
    """Eq. 1 between weighted poses (N, 12, 3) and (M, 12, 3): (N, M)."""
    return np.linalg.norm(a[:, None] - b[None], axis=-1).sum(axis=-1)


@pytest.fixture(scope="module")
def costs(library, track, asked):
    order = build_request(library, resolve_plan(Plan(track=track, timeline=asked), library))
    return lambda **more: PathCosts(library, order, **more)


def test_it_is_equation_1(library):
    """Planted: two clips' poses, weighted and compared by hand."""
    weights = BoneWeights((1.0, 0.5, 2.0, 0.0, 3.0, 1.0), (0.1, 0.2, 0.0, 0.3, 0.1, 0.4))
    first, other = library.frames.first[:2]
    clips, at = library.clips[:2], np.array([3.0, 11.0])
    poses = [
        align_poses(clip.motion, library.frames.source[start + 3 : start + 12 : 8])
        for clip, start in zip(clips, (first, other))
    ]
    by_hand = np.zeros((2, 2))
    for bone in range(len(BONES)):
        for part, own in enumerate((weights.position, weights.velocity)):
            way = poses[0][part][:, None, bone] - poses[1][part][None, :, bone]
            by_hand += own[bone] * np.linalg.norm(way, axis=-1)
    rows = weigh_bones(library, weights)
    found = pose_distance(rows[first + at.astype(int)], rows[other + at.astype(int)])
    np.testing.assert_allclose(found * sum(BoneWeights().position), by_hand, rtol=1e-3, atol=1e-3)


def test_the_search_pays_for_it(library, costs):
    """A cut's price is eq. 1 where it is given, the mean over the frames around it; and the weights steer it."""
    ends, start = np.array([40.0, 90.0]), np.arange(200.0, 260.0)
    rows = weigh_bones(library)
    one = dict(costs(bone_distance=BoneDistance(rows)).cuts.iter_cut_terms(ends, start))["pose"]
    at = ends.astype(int), start.astype(int)
    np.testing.assert_allclose(one, Weights().pose * pose_distance(rows[at[0]], rows[at[1]]), rtol=1e-3, atol=1e-3)
    around = dict(costs(bone_distance=BoneDistance(rows, (-6, 6))).cuts.iter_cut_terms(ends, start))["pose"]
    assert not np.allclose(one, around, rtol=0.02)
    hands = BoneWeights((0.0, 0.0, 8.0, 0.0, 0.0, 0.0), (0.0,) * 6)
    cuts = costs(bone_distance=BoneDistance(weigh_bones(library, hands))).cuts
    other = dict(cuts.iter_cut_terms(ends, start))["pose"]
    assert np.any(np.argsort(one[0]) != np.argsort(other[0]))


def test_without_it_the_features_count_as_ever(library, costs):
    ends, start = np.array([40.0]), np.arange(200.0, 210.0)
    features = library.frames.features
    wanted_cost = Weights().pose * np.linalg.norm(features[[40]][:, None] - features[200:210][None], axis=-1)
    found = dict(costs().cuts.iter_cut_terms(ends, start))["pose"]
    np.testing.assert_allclose(found, wanted_cost, rtol=1e-3, atol=1e-3)


def test_a_pose_is_like_itself_wherever_it_stands(library):
    rows = measure_bones(library)
    assert rows.shape == (len(library.frames), 2 * len(BONES), 3) and np.all(np.isfinite(rows))
    np.testing.assert_allclose(np.abs(rows[:, 0, :2]).max(), 0.0, atol=1e-6)
