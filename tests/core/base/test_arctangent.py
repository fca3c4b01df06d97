"""The same angles wherever arrays lie in memory."""

import pathlib
import subprocess
import sys

import numpy as np

from beyond_mocap.base.vectors import arctan2

TOP = pathlib.Path(__file__).resolve().parents[3]
PLACES = """
import numpy as np
from beyond_mocap.base.vectors import arctan2
vectors = np.random.default_rng(4).normal(size=(1801, 3))
sine = vectors[:, 0].copy()
expected, others, kept = np.arctan2(sine, vectors[:, 1].copy()), 0, []
for number in range(100):
    block = np.empty(4 * len(vectors) + 2 + number % 4)
    del block  # its place holds the vectors and, in every other round right behind them, their angles
    copy = np.empty_like(vectors)
    copy[:] = vectors
    angles = arctan2(sine, copy[:, 1])
    others += not np.array_equal(angles, expected)
    kept = [copy, angles]
print("others:", others)
"""


def test_where_a_result_lies_changes_no_bit():
    """In a process of its own, whose memory nobody has cut up; numpy's own function built with AVX-512 gives other bits
    in half of the rounds."""
    run = subprocess.run([sys.executable, "-c", PLACES], cwd=TOP, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "others: 0"


def test_numbers_stay_numbers():
    assert arctan2(1.0, 0.0) == np.pi / 2 and np.ndim(arctan2(1.0, 0.0)) == 0
    assert arctan2(np.ones((2, 3)), 1.0).shape == (2, 3)
