"""The flights of passing scenes of this session, for the overlays: that which is shown, and while a place is dragged,
those of where it is just now."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np

if TYPE_CHECKING:
    from ...beyond_mocap.ball.physics import Ball
    from ...beyond_mocap.passes.pass_plan import PassPlan

STEP = 0.03  # s between two points of a way
MOST = 40  # candidates of a strike that are kept
KEPT = 20  # scenes

_rallies: dict[str, "Rally"] = {}  # by the digest of what they were made of
_dragged: list["Rally"] = []


@dataclass(frozen=True, eq=False)
class Rally:
    """Plain numbers, metres in the world. start: scene frame of second 0; starts (K,) s and ways, (n, 3) m each, of the
    flights; strikes (S, 3) m and strike_times (S,) s; bounces (B, 3) m; candidates: (M, T, 3) m for each strike, from
    which its way was chosen, empty for the last one."""

    start: float
    starts: np.ndarray
    ways: tuple[np.ndarray, ...]
    strike_times: np.ndarray
    strikes: np.ndarray
    bounces: np.ndarray
    candidates: tuple[np.ndarray, ...]

    def flight_at(self, seconds: float) -> int:
        """The number of the flight in which the ball is."""
        return int(np.clip(np.searchsorted(self.starts, seconds + 1e-9, side="right") - 1, 0, len(self.ways) - 1))


def of_plan(plan: "PassPlan", ball: "Ball", start: float) -> Rally:
    """What is drawn of a plan."""
    ends = [*(flight.launch.time for flight in plan.flights[1:]), plan.seconds]
    ways, met = [], []
    for flight, end in zip(plan.flights, ends):
        end = min(end, flight.end)
        bounces = flight.bounces[flight.bounces < end]
        times = np.unique(np.concatenate([np.arange(flight.launch.time, end, STEP), bounces, [end]]))
        ways.append(flight.at(times))
        met += list(flight.at(bounces) * [1.0, 1.0, 0.0]) if len(bounces) else []
    return Rally(
        start, np.array([flight.launch.time for flight in plan.flights]), tuple(ways),
        np.array([one.order.time for one in plan.strikes]), np.array([one.order.ball for one in plan.strikes]),
        np.array(met).reshape(-1, 3), tuple(_candidates(one, ball) for one in plan.strikes),
    )  # fmt: skip


def _candidates(strike, ball: "Ball") -> np.ndarray:
    """Ways (M, T, 3) that the ball could have taken from a strike (Fig. 6, black)."""
    from ...beyond_mocap.ball.batch import courses

    natural = strike.natural
    if natural is None or not len(natural.starts) or strike.travel <= 0.0:
        return np.zeros((0, 0, 3))
    few = slice(None, None, max(1, -(-len(natural.starts) // MOST)))
    times = np.linspace(0.0, strike.travel, max(2, int(strike.travel / (2 * STEP))))
    return courses(natural.starts[few], natural.velocities[few], None, ball, times)[0]


def keep(digest: str, rally: Rally) -> None:
    """Keep what was made of `digest`, so that undo and redo find it."""
    _dragged.clear()
    _rallies.pop(digest, None)
    _rallies[digest] = rally
    while len(_rallies) > KEPT:
        _rallies.pop(next(iter(_rallies)))


def show_dragged(rally: Rally | None) -> None:
    """Draw this one while a place is dragged; None: no more."""
    _dragged[:] = [rally] if rally is not None else []


def anything() -> bool:
    """Whether there is anything to draw; quick, since it is asked at every redraw."""
    return bool(_rallies or _dragged)


def of(scene: bpy.types.Scene) -> Rally | None:
    """The rally of a scene; None where this session has not made it."""
    made_of = scene.beyond_mocap_passes.made_of
    if not made_of:
        return None
    return _dragged[0] if _dragged else _rallies.get(made_of)


def forget() -> None:
    """Nothing is remembered any more."""
    _rallies.clear()
    _dragged.clear()
