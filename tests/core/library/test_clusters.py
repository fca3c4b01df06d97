"""Blocks grouped by k-means: every block in one group, every group with a member that stands for it."""

import sys

import numpy as np
import pytest

from beyond_mocap.library.build import build_library
from beyond_mocap.library.clusters import (
    BLOCK_LENGTHS,
    CLUSTERS,
    _count_cores_quietly,
    cluster_blocks,
    find_block_starts,
)


@pytest.mark.parametrize("length", BLOCK_LENGTHS)
def test_blocks_lie_within_one_clip_and_none_is_forgotten(library, length):
    start = library.clusters[length].start
    assert np.array_equal(library.frames.clip[start], library.frames.clip[start + length - 1])
    assert len(start) == np.sum(np.maximum(library.frames.count - length + 1, 0))
    assert np.array_equal(start, find_block_starts(library.frames, length))


@pytest.mark.parametrize("length", BLOCK_LENGTHS)
def test_labels_and_medoids_agree(library, length):
    clusters = library.clusters[length]
    count = len(clusters.medoid)
    assert 0 < count <= CLUSTERS
    assert sorted(set(clusters.label)) == list(range(count))
    assert np.array_equal(clusters.label[clusters.medoid], np.arange(count))
    assert len(clusters.label) == len(clusters.start)
    assert all(clusters.label_at(start) == label for start, label in zip(clusters.start, clusters.label))


@pytest.mark.parametrize("length", BLOCK_LENGTHS)
def test_blocks_of_a_cluster_are_alike(library, length):
    clusters, features = library.clusters[length], library.frames.features
    blocks = features[clusters.start[:, None] + np.arange(length)].reshape(len(clusters.start), -1)
    medoids = blocks[clusters.medoid]
    to_own = np.linalg.norm(blocks - medoids[clusters.label], axis=1)
    to_next = np.linalg.norm(blocks - medoids[(clusters.label + 1) % len(medoids)], axis=1)
    assert np.mean(to_own < to_next) > 0.95 and to_own.mean() < 0.6 * to_next.mean()


def test_no_cluster_where_no_block_starts(library):
    clusters = library.clusters[32]
    assert clusters.label_at(int(library.frames.count[0]) - 1) == -1
    assert clusters.label_at(len(library.frames) + 5) == clusters.label_at(-1) == -1


def test_the_same_seed_gives_the_same_clusters(library):
    a, b = (cluster_blocks(library.frames, 16, seed=0) for _ in range(2))
    assert np.array_equal(a.label, b.label) and np.array_equal(a.medoid, b.medoid)
    assert np.array_equal(a.label, library.clusters[16].label)


def test_clips_too_short_for_a_block_have_none(tmp_path, clip_file):
    clip_file(tmp_path / "walk.bvh", 1.4, 0.6)
    library = build_library(tmp_path)
    assert [len(library.clusters[length].start) for length in BLOCK_LENGTHS] == [0, 2 * 4, 2 * 12]
    assert len(library.clusters[32].medoid) == 0 and library.clusters[32].label_at(0) == -1


@pytest.mark.skipif(sys.platform != "linux", reason="hides the cores as Linux does")
def test_a_machine_that_hides_its_cores_gets_no_warning(monkeypatch, recwarn, capsys):
    from joblib.externals.loky.backend import context

    monkeypatch.setattr(context, "physical_cores_cache", None)
    monkeypatch.setattr(context, "_count_physical_cores_linux", lambda: 0)
    monkeypatch.setattr(context, "_cpu_count_user", lambda count: count)
    _count_cores_quietly()
    assert context.cpu_count(only_physical_cores=True) > 0  # as scikit-learn asks afterwards
    assert not recwarn.list and capsys.readouterr().err == ""
