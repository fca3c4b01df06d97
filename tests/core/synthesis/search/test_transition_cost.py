"""How far two moments of the library are apart."""

import numpy as np
import pytest

from beyond_mocap.synthesis.search.block_costs import collect_windows, compute_distances, measure_typical_distance


def test_distances_are_euclidean():
    random = np.random.default_rng(0)
    a, b = random.normal(size=(7, 5)), random.normal(size=(4, 5))
    assert np.allclose(compute_distances(a, b), np.linalg.norm(a[:, None] - b[None], axis=2))
    assert np.allclose(np.diag(compute_distances(a, a)), 0.0,
                       atol=1e-7) and not np.any(np.isnan(compute_distances(a, a)))


def test_a_window_lies_around_its_centre(library):
    frames = library.frames
    first = int(frames.first[4])
    found = collect_windows(frames, np.array([4]), np.array([first + 50]), 8)
    assert np.array_equal(found[0], frames.features[first + 46 : first + 54].ravel())


@pytest.mark.parametrize("size", [4, 8, 16])
def test_a_window_that_would_leave_its_clip_is_moved_inwards(library, size):
    frames = library.frames
    clip = 3
    first, last = int(frames.first[clip]), int(frames.first[clip] + frames.count[clip] - 1)
    for centre, start in ((first, first), (first - 9, first), (last, last - size + 1), (last + 99, last - size + 1)):
        found = collect_windows(frames, np.array([clip]), np.array([centre]), size)
        assert np.array_equal(found[0], frames.features[start : start + size].ravel())


def test_a_clip_shorter_than_the_window_holds_its_last_frame(library):
    class Short:
        first, count, features = np.array([0, 3]), np.array([3, 5]), np.arange(8.0)[:, None]

    assert collect_windows(Short, np.array([0]), np.array([1]), 6).tolist() == [[0, 1, 2, 2, 2, 2]]
    assert collect_windows(Short, np.array([1]), np.array([7]), 6).tolist() == [[3, 4, 5, 6, 7, 7]]


def test_going_on_in_a_clip_costs_nothing(library):
    frames = library.frames
    start = np.array([int(frames.first[2]) + 20])
    after = collect_windows(frames, np.array([2]), start + 8, 4)
    before = collect_windows(frames, np.array([2]), start + 8, 4)
    assert compute_distances(after, before)[0, 0] < 1e-3


def test_the_typical_distance_is_that_of_frames_taken_at_random(library):
    features = library.frames.features.astype(float)
    random = np.random.default_rng(1)
    a, b = features[random.integers(0, len(features), (2, 20000))]
    assert measure_typical_distance(library.frames) == pytest.approx(np.sqrt(np.mean(np.sum((a - b) ** 2, axis=1))),
                                                                     rel=0.03)


def test_a_library_that_never_moves_has_a_scale():
    class Still:
        features = np.zeros((5, 2), np.float32)

    assert measure_typical_distance(Still) == 1.0
