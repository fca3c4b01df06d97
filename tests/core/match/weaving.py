"""A player of a match on a bent line, and what a made library shows of him in windows."""

import numpy as np
import pytest

from beyond_mocap.annotation import parse_timeline
from beyond_mocap.match.player_edit import PlayerEdit
from beyond_mocap.match.searched import Piece, searched
from beyond_mocap.match.splice import spliced
from beyond_mocap.match.units import units_of
from beyond_mocap.motion.track import Track
from beyond_mocap.plan import Plan

KICK_TIME = 20.5


def weaving(start: float, end: float) -> Track:
    """Samples at 25 Hz of a player who walks and jogs on a bent line, from second `start` to `end`."""
    times = np.arange(start, end + 1e-9, 0.04)
    way = 2.0 * (times - start) + 2.0 * np.sin(0.6 * times)
    return Track(times, np.column_stack([way, 4.0 * np.sin(0.08 * way)]), name="home_7")


@pytest.fixture(scope="session")
def weaving_plan() -> Plan:
    """25 s from 5 s on, with a kick at KICK_TIME."""
    timeline = parse_timeline(f"{KICK_TIME} kick right\n", fps=30.0)
    return Plan(track=weaving(5.0, 30.0), timeline=timeline, nearest=True)


@pytest.fixture(scope="session")
def weaving_pieces(library, weaving_plan) -> tuple[Piece, ...]:
    """What is found for its windows of 8 s."""
    return tuple(searched(library, unit) for unit in units_of(weaving_plan, window=8.0, overlap=3.0))


@pytest.fixture(scope="session")
def weaving_player(library, weaving_plan, weaving_pieces) -> PlayerEdit:
    """The player that they make, laid out in windows of 8 s."""
    return spliced(library, [weaving_plan], weaving_pieces, 8.0)[0]
