"""One body among many: its capsules over time, what it has of its contacts, and where curves bring it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...motion import quaternion
from .capsules import Capsule
from .correction import ARMS, FEET, ROOT


@dataclass(frozen=True, eq=False)
class CrowdBody:
    """One body over T common frames. parts: its C capsules; lines (T, C, 2, 3) m, NaN where it is not there; bent (T,
    C, 2, 3) m: how far from where its curves alone bring them limbs have come by being bent for earlier curves; stands
    (T, 2) bool, left and right foot; firm (T,): how firmly it keeps its way against others."""

    parts: tuple[Capsule, ...]
    lines: np.ndarray
    bent: np.ndarray
    stands: np.ndarray
    firm: np.ndarray

    @property
    def radii(self) -> np.ndarray:
        """(C,) m."""
        return np.array([part.radius for part in self.parts])

    @property
    def there(self) -> tuple[int, int]:
        """First frame and end of where it is there."""
        known = np.flatnonzero(np.isfinite(self.lines[:, 0, 0, 0]))
        return (int(known[0]), int(known[-1]) + 1) if len(known) else (0, 0)

    def frames(self, low: int, high: int) -> CrowdBody:
        """Frames low .. high of it."""
        rows = (values[low:high] for values in (self.lines, self.bent, self.stands, self.firm))
        return CrowdBody(self.parts, *rows)


@dataclass(frozen=True, eq=False)
class Contact:
    """What one body has of its contacts (K,): frame, part, place (K, 3) m, away (K, 3) unit from the other, give (K,)
    m that it should give way by, its share of the overlap; arm (K,) m that its arm should, where the part is one."""

    frame: np.ndarray
    part: np.ndarray
    at: np.ndarray
    place: np.ndarray
    away: np.ndarray
    give: np.ndarray
    arm: np.ndarray


def moved(body: CrowdBody, curves: np.ndarray) -> np.ndarray:
    """(T, C, 2, 3) m: the capsules' lines with curves (T, 12) put on the body, bones taken for as long as they have to
    be."""
    out = np.array(body.lines)
    feet, arms = curves[:, FEET].reshape(-1, 2, 2), curves[:, ARMS].reshape(-1, 2, 3)
    pivot: dict[int, np.ndarray] = {}
    for number, part in enumerate(body.parts):
        if part.limb == "arm":
            centre = pivot.setdefault(part.side, body.lines[:, number, 0])
            turn = quaternion.from_rotation_vector(arms[:, part.side])[:, None]
            out[:, number] = centre[:, None] + quaternion.rotate(turn, body.lines[:, number] - centre[:, None])
        share = np.array(part.along)[:, None] if part.limb == "leg" else np.zeros((2, 1))
        out[:, number, :, :2] += (1.0 - share) * curves[:, None, ROOT] + share * feet[:, None, part.side]
    return out + body.bent
