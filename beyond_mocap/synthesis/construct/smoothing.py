"""Discontinuities spread over the frames around them (Faustino §3.3.1 eq. 25, 26, after Arikan and Forsyth 2002)."""

from __future__ import annotations

import numpy as np

from ...motion import quaternion

LONGEST = 12


def bump(offset: np.ndarray, reach: float) -> np.ndarray:
    """Eq. 25: how much of a discontinuity is added at `offset` frames (N,) from it, `reach` being s: it grows to 1/2
    just before the discontinuity, jumps to -1/2 at it and shrinks to 0, with a continuous slope everywhere else."""
    x = (np.asarray(offset, dtype=float) + reach) / max(reach, 1e-9)
    rising = 0.5 * x**2
    falling = -0.5 * x**2 + 2.0 * x - 2.0
    return np.where((offset < -reach) | (offset > reach), 0.0, np.where(offset < 0, rising, falling))


def reaches(seams: np.ndarray, count: int, longest: float = LONGEST) -> np.ndarray:
    """(S,) the s of eq. 25 for each seam: half of the shorter neighbouring stretch, so that windows never overlap, and
    at most `longest` frames."""
    edges = np.concatenate([[0], seams, [count]])
    lengths = np.diff(edges)
    return np.minimum(np.minimum(lengths[:-1], lengths[1:]) / 2.0, longest)


def spread_values(
    values: np.ndarray, seams: np.ndarray, ahead: np.ndarray, longest: float = LONGEST
) -> np.ndarray:
    """Values (T, ...) without their jumps at `seams`; `ahead` (S, ...): what the frame at each seam would have been if
    the piece before had gone on."""
    out = np.array(values, dtype=float)
    for seam, expected, reach in zip(seams, ahead, reaches(seams, len(values), longest)):
        at, weight = _window(seam, reach, len(values))
        out[at] += weight.reshape(-1, *[1] * (out.ndim - 1)) * (values[seam] - expected)
    return out


def spread_rotations(
    rotations: np.ndarray, seams: np.ndarray, ahead: np.ndarray, longest: float = LONGEST
) -> np.ndarray:
    """The same for rotations (T, J, 4), `ahead` (S, J, 4): the discontinuity of eq. 26 is the rotation from the
    expected pose to the one after the seam, spread as a share of its rotation vector.

    Eq. 26 subtracts the other way round for the root, which would double its jump; all joints are treated alike here.
    """
    out = np.array(rotations, dtype=float)
    for seam, expected, reach in zip(seams, ahead, reaches(seams, len(rotations), longest)):
        at, weight = _window(seam, reach, len(rotations))
        jump = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(expected), rotations[seam]))
        turn = quaternion.from_rotation_vector(weight[:, None, None] * jump)
        out[at] = quaternion.multiply(out[at], turn)
    return out


def _window(seam: int, reach: float, count: int) -> tuple[slice, np.ndarray]:
    low, high = max(0, int(np.ceil(seam - reach))), min(count, int(np.floor(seam + reach)) + 1)
    return slice(low, high), bump(np.arange(low, high) - seam, reach)
