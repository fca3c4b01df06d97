"""What the tables of Fredriksson §8.3 print, to stand beside ours: four subjects, each row one trained model, in
metres.

Where his own tables do not agree (8.3, 8.4 and 8.7 against the differences of 8.1, 8.2, 8.5, 8.6) they are kept as
printed; `disagreements` finds the places.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .subjects import EFFECTOR_NAMES, Subjects

PLACES = (*EFFECTOR_NAMES, "impact")


@dataclass(frozen=True, eq=False)
class Printed:
    """differences (4, 5): limbs and impact, new - old; mean, spread, p (5,): his last rows, NaN where he prints
    none."""

    differences: np.ndarray
    mean: np.ndarray
    spread: np.ndarray
    p: np.ndarray


def _subjects(name: str, rows) -> Subjects:
    rows = np.array(rows)
    return Subjects(name, ("1", "2", "3", "4"), rows[:, :4], rows[:, 4], *np.zeros((3, 4), int))


SINGLE = _subjects("single PFNN", [
    [0.1597, 0.1433, 0.0814, 0.0915, 2.034], [0.1263, 0.1001, 0.0816, 0.0798, 2.054],
    [0.2120, 0.1950, 0.1331, 0.1444, 3.975], [0.1677, 0.1420, 0.1014, 0.1312, 1.456],
])  # fmt: skip
"""Table 8.1."""
HIERARCHY_RAW = _subjects("hierarchy PFNN", [
    [0.0728, 0.0639, 0.0323, 0.0328, 2.007], [0.0511, 0.0496, 0.0266, 0.0275, 2.542],
    [0.0992, 0.0962, 0.0483, 0.0427, 2.181], [0.0767, 0.0574, 0.0452, 0.0400, 1.819],
])  # fmt: skip
"""Table 8.2: without IK, pose iterations and wrist orientation."""
FEED_FORWARD = _subjects("hierarchy feed-forward", [
    [0.0662, 0.0612, 0.0415, 0.0493, 1.654], [0.0706, 0.0875, 0.0409, 0.0360, 2.226],
    [0.1106, 0.0817, 0.0507, 0.0431, 1.985], [0.0881, 0.0760, 0.0406, 0.0594, 1.252],
])  # fmt: skip
"""Table 8.5: with all three."""
HIERARCHY = _subjects("hierarchy PFNN", [
    [0.0525, 0.0505, 0.0178, 0.0219, 0.831], [0.0391, 0.0410, 0.0175, 0.0157, 0.705],
    [0.0714, 0.0818, 0.0380, 0.0227, 0.867], [0.0583, 0.0451, 0.0291, 0.0217, 0.861],
])  # fmt: skip
"""Table 8.6: with all three."""
FIRST = Printed(
    np.array([[-0.0869, -0.0794, -0.0492, -0.0587, -0.0273], [-0.0751, -0.0506, -0.0551, -0.0523, 0.4873],
              [-0.1128, -0.0988, -0.0848, -0.1017, -1.7758], [-0.0909, -0.0846, -0.0563, -0.0912, 0.3626]]),
    np.array([-0.0914, -0.0784, -0.0613, -0.0760, -0.2383]), np.array([0.0136, 0.0175, 0.0138, 0.0209, 0.9077]),
    np.array([0.0007, 0.0022, 0.0023, 0.0040, np.nan]),
)  # fmt: skip
"""Tables 8.3 and 8.4."""
SECOND = Printed(
    np.array([[-0.0138, -0.0106, -0.0244, -0.0275, -0.8235], [-0.0315, -0.0465, -0.0248, -0.0177, -1.5209],
              [-0.0393, 0.0001, -0.0119, -0.0211, -1.1184], [-0.0299, -0.0309, -0.0109, -0.0357, -0.3909]]),
    np.array([-0.0286, -0.0220, -0.0178, -0.0264, -0.9634]), np.array([0.0093, 0.0180, 0.0058, 0.0071, 0.4130]),
    np.array([0.0064, 0.0625, 0.0064, 0.0038, 0.0136]),
)  # fmt: skip
"""Tables 8.7 and 8.8."""
EXPERIMENTS = {"8.3, 8.4": (SINGLE, HIERARCHY_RAW, FIRST), "8.7, 8.8": (FEED_FORWARD, HIERARCHY, SECOND)}
"""Tables of differences -> old way, new way, what is printed."""
ROUNDING = {"limb": 0.00016, "impact": 0.0016}
"""m: more than this apart are two printed figures, their difference and a printed difference not by rounding."""


def disagreements() -> list[str]:
    """Where a printed difference is not that of the printed figures, one line each."""
    lines = []
    for tables, (old, new, printed) in EXPERIMENTS.items():
        ours = new.figures - old.figures
        for subject, place in zip(*np.nonzero(np.abs(ours - printed.differences) > 0.0), strict=True):
            off = abs(ours[subject, place] - printed.differences[subject, place])
            if off > ROUNDING["impact" if PLACES[place] == "impact" else "limb"]:
                lines.append(f"tables {tables}, subject {subject + 1}, {PLACES[place]}: printed "
                             f"{printed.differences[subject, place]:.4f}, by the figures {ours[subject, place]:.4f}")
    return lines
