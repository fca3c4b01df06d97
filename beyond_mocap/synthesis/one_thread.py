"""Linear algebra with one thread: more threads add up in another order, and results get other bits."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager
from functools import lru_cache


def limit_to_one_thread() -> AbstractContextManager:
    """Hold linear algebra to one thread while the returned context lasts."""
    return _find_libraries(len(sys.modules)).limit(limits=1)


@lru_cache(maxsize=1)
def _find_libraries(modules: int):
    """Find the libraries of linear algebra; again once more modules are imported, which may have brought others."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
