"""Linear algebra with one thread: more threads add up in another order, and results get other bits."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import lru_cache


def limit_to_one_thread() -> AbstractContextManager:
    """Hold linear algebra to one thread while the returned context lasts."""
    return _find_libraries().limit(limits=1)


@lru_cache(maxsize=1)
def _find_libraries():
    """Find the libraries of linear algebra: those that numpy and scipy have loaded, which takes a while."""
    import scipy.linalg  # noqa: F401
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
