"""What workers prepare of a match has the same bits wherever it is done."""

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from beyond_mocap.match.pieces import preparation


def list_threads(*_):
    return [one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"]


def test_linear_algebra_has_one_thread_also_on_a_cluster(monkeypatch):
    monkeypatch.setattr(preparation, "solve_episode", list_threads)
    monkeypatch.setattr(preparation, "plan_player_heading", list_threads)
    monkeypatch.setattr(preparation, "load_library", lambda source: None)
    with threadpool_limits(2):
        if 2 not in list_threads():
            pytest.skip("linear algebra has one thread here")
        assert set(preparation.solve_spacing()) == set(preparation.plan_headings(None, [(None, None)])[0]) == {1}
