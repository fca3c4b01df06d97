"""Angles of vectors that come out the same to the last bit wherever the numbers lie in memory."""

from __future__ import annotations

import numpy as np


def arctan2(y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """`numpy.arctan2` in radians of arrays that go together.

    numpy works out a column of a wider array by another formula, up to two units in the last place away, whenever the
    result happens to lie right behind that array in memory. Contiguous copies never touch what comes out.
    """
    return np.arctan2(np.asarray(y, order="C"), np.asarray(x, order="C"))
