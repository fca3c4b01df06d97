"""Linear algebra with one thread, of numpy and scipy: more threads add up in another order, and bits differ."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import lru_cache


def limit_to_one_thread() -> AbstractContextManager:
    """Hold linear algebra to one thread while the returned context lasts."""
    return _find_libraries().limit(limits=1)


@lru_cache(maxsize=1)
def _find_libraries():
    """Find the libraries of linear algebra; scipy's, which is not numpy's, would else be loaded within the context."""
    import scipy.linalg  # noqa: F401
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
