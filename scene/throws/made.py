"""The throw that comes of an order, worked out in any thread: never touches bpy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from .order import Order

if TYPE_CHECKING:
    from ...beyond_mocap.ball.flight import Flight
    from ...beyond_mocap.library.library import Library
    from ...beyond_mocap.motion.motion import Motion
    from ...beyond_mocap.throws.join_throw import JoinedThrow
    from ...beyond_mocap.throws.throw_order import Thrown

FOLLOWED, LONGEST = 3.0, 10.0
"""Seconds that the ball is followed behind the target, bouncing and rolling, and that it takes to get there at most."""
_GUESS, _ROUNDS = 1.0, 5  # s of flight to a target that moves, to begin with; how often that is made better at most


@dataclass(frozen=True, eq=False)
class Result:
    """What came of an order: the throw, the whole motion that shows it, the ball's way from the release on (seconds 0),
    seconds until it passes the target, and m/s^3 of the seams and what is usual there."""

    order: Order
    thrown: "Thrown"
    joined: "JoinedThrow"
    flight: "Flight"
    seconds: float
    library: "Library | None"
    jerk: float
    usual_jerk: float


def work(order: Order, progress, cancelled, _hurry) -> Result:
    """The throw, and the motion it is part of. Never touches bpy."""
    from ...beyond_mocap.ball.flight import fly
    from ...beyond_mocap.library.build import build
    from ...beyond_mocap.motion.retargeting.retarget import Retargeter
    from ...beyond_mocap.throws.join_throw import EASED, FADE, join_throw, library_jerk, stand_still, transition_jerk
    from ...beyond_mocap.throws.leave_path import leave_path

    library = order.library
    if order.folder and library is None:
        library = build(order.folder, unit=order.unit, **order.build, progress=progress, cancelled=cancelled)
    own = order.own
    if own is None:
        own = stand_still(order.skeleton, 0.0, order.fps, order.place, order.facing)
    elif order.table:
        own = Retargeter(own, order.skeleton, keeps_travel=True).carry(own)
    start = order.first / order.fps
    asked = order
    order, thrown, seconds = _met(order, own, start, joined=library is not None, progress=_share(progress, 0.0, 0.3),
                                  cancelled=cancelled)
    motion, release = _shown(order, thrown, library is not None)
    told: tuple = ()
    if library is not None:
        way = leave_path(library, own, start, motion, release, at=order.at, action=order.act,
                         progress=_share(progress, 0.3, 1.0), cancelled=cancelled)
        own, start, told = way.motion, way.start, way.warnings
    fade = FADE if library is not None else EASED[order.act]
    joined = join_throw(own, start, motion, release, at=order.at, goes_on=library is None, fade=fade)
    usual = library_jerk(library, order.fps) if library is not None else float("nan")
    joined = replace(joined, warnings=(*_when(asked, order, joined), *told, *joined.warnings))
    up = np.array([0.0, 0.0, order.lift])
    raised = replace(joined.motion, root_positions=joined.motion.root_positions + up)
    joined = replace(joined, motion=raised)
    launch = replace(thrown.launch, time=0.0, position=thrown.launch.position + up)
    flight = fly(launch, thrown.ball, seconds + FOLLOWED)
    return Result(order, thrown, joined, flight=flight, seconds=seconds, library=library,
                  jerk=float(transition_jerk(joined).max()), usual_jerk=usual)


def _met(order: Order, own: "Motion", start: float, joined: bool, progress, cancelled):
    """The order as it can be kept, its throw, and the seconds that the ball flies: it leaves later where the throw
    would begin before the scene and may wait, and a target that moves is met where it is by then."""
    seconds = _GUESS
    for _ in range(_ROUNDS):
        target = order.targets[min(round(seconds * order.fps), len(order.targets) - 1)]
        thrown = _thrown(order, target, own, start=start, joined=joined, progress=progress, cancelled=cancelled)
        guessed, seconds = seconds, _seconds(thrown)
        late = int(np.ceil((order.begins + _shown(order, thrown, joined)[1] - order.at) * order.fps - 1e-6))
        if order.waits and late > 0:
            targets = order.targets[min(late, len(order.targets) - 1) :]
            order = replace(order, at=order.at + late / order.fps, targets=targets, waits=False)
        elif len(order.targets) == 1 or abs(seconds - guessed) * order.fps < 0.5:
            break
    return order, thrown, seconds


def _when(asked: Order, order: Order, joined: "JoinedThrow") -> list[str]:
    """Lines about a throw that does not fit into the scene before its release."""
    first = round(order.begins * order.fps)
    begins = round(joined.start * order.fps) + joined.first
    if order.at != asked.at:
        return [f"the ball leaves on frame {round(order.at * order.fps)}: sooner the {order.act} would begin before "
                f"the scene's first frame"]
    if begins >= first:
        return []
    frame = round(order.at * order.fps) + first - begins
    return [f"the {order.act} begins on frame {begins}, before the scene's first frame {first}: set On Frame to "
            f"{frame} or more to see all of it"]


def _shown(order: Order, thrown: "Thrown", joined: bool) -> tuple["Motion", float]:
    """What is shown of a throw, and its release in that: a body on its way does not stop to wait."""
    from ...beyond_mocap.throws.join_throw import EASED, trim_waiting
    from ...beyond_mocap.throws.run_up import EDGE

    return trim_waiting(thrown.motion, thrown.release, EDGE if joined else EASED[order.act])


def _thrown(order: Order, target, own: "Motion", start: float, joined: bool, progress, cancelled) -> "Thrown":
    """The throw where it has to be: begun where an armature that only stands is; over where its own motion has it at
    the release, if a library joins them; else begun where its own motion leads, since it is eased out of that."""
    from ...beyond_mocap.throws.leave_path import is_in_reach, stopping_place
    from ...beyond_mocap.throws.network_npz import read_model, shipped_model

    def spot(seconds: float) -> tuple[float, ...]:
        return tuple(own.root_positions[int(np.clip(round((seconds - start) * own.fps), 0, len(own) - 1)), :2])

    model = read_model(order.model) if order.model else shipped_model(order.act)
    throw = partial(_thrown_from, order, target, model, progress=progress, cancelled=cancelled)
    if order.ball_place is not None:
        return throw(where={"ball_place": tuple(order.ball_place)})
    if order.own is None:
        return throw(where={"start": tuple(order.place)})
    thrown = throw(where={"over": spot(order.at)})
    motion, release = _shown(order, thrown, joined)
    begin = order.at - release
    if not joined:
        return throw(where={"start": spot(begin)})
    if is_in_reach(own, start, motion, release, order.at):
        return thrown
    return throw(where={"start": tuple(stopping_place(own, start, begin))})


def _thrown_from(order: Order, target, model, where: dict, progress, cancelled) -> "Thrown":
    """The throw that begins, or is at its release, or finds the ball, `where`."""
    from ...beyond_mocap.throws import throw, throw_order

    asked = throw_order.Order(target=tuple(target - [0.0, 0.0, order.lift]), limb=order.limb,
                              speed=order.speed or None, ball=order.kind, fps=order.fps, seed=order.seed, **where)
    return throw.throw_at(model, asked, order.skeleton, progress, cancelled)


def _seconds(thrown: "Thrown") -> float:
    """When the ball is nearest to where it passes the target, from the release on."""
    from ...beyond_mocap.ball.flight import fly

    flight = fly(replace(thrown.launch, time=0.0), thrown.ball, LONGEST)
    times = np.arange(0.0, flight.end, 1.0 / 480.0)
    apart = np.linalg.norm(flight.at(times) - thrown.impact, axis=1)
    return float(times[int(np.argmin(apart))]) if np.all(np.isfinite(thrown.impact)) else _GUESS


def _share(progress, low: float, high: float):
    """A progress that fills a part of the bar."""
    return lambda done, text: progress(low + (high - low) * done, text)
