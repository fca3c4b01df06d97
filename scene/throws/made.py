"""Generate the throw that a request asks for, in any thread: never uses bpy."""

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
"""Seconds of the ball's flight shown beyond the target, bouncing and rolling, and the longest flight to the target."""
_GUESS, _ROUNDS = 1.0, 5  # first estimate, s, of the flight to a moving target; largest number of corrections of it


@dataclass(frozen=True, eq=False)
class Result:
    """A generated throw.

    Attributes:
        order: the request, with the actual release time.
        thrown: the throw.
        joined: the whole motion with the throw in it.
        flight: the ball's trajectory from the release (0 s).
        seconds: s until the ball passes the target.
        library: library of the run-up, or None.
        jerk: m/s^3, largest jerk of the transitions.
        usual_jerk: m/s^3, usual jerk of the library's recordings, NaN without a library.
    """

    order: Order
    thrown: "Thrown"
    joined: "JoinedThrow"
    flight: "Flight"
    seconds: float
    library: "Library | None"
    jerk: float
    usual_jerk: float


def work(order: Order, progress, cancelled, _hurry) -> Result:
    """Generate a throw, and the motion it is part of.

    Args:
        order: the request.
        progress: receives a share of 0 .. 1 and a text.
        cancelled: returns True to stop.
    """
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
    """Generate the throw, with release time and target adapted to it.

    The ball leaves later if the throw would begin before the scene and may wait, and a moving target is aimed at
    where it is on arrival.

    Returns:
        The adapted request, the throw, and the s of the ball's flight.
    """
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
    """List warnings about a throw that begins before the scene."""
    first = round(order.begins * order.fps)
    begins = round(joined.start * order.fps) + joined.first
    if order.at != asked.at:
        return [f"the ball leaves on frame {round(order.at * order.fps)}: with an earlier release the {order.act} "
                f"begins before the scene's first frame"]
    if begins >= first:
        return []
    frame = round(order.at * order.fps) + first - begins
    return [f"the {order.act} begins on frame {begins}, before the scene's first frame {first}: set Release Frame to "
            f"{frame} or more to see all of it"]


def _shown(order: Order, thrown: "Thrown", joined: bool) -> tuple["Motion", float]:
    """Cut the waiting time from a throw, since a moving body does not stop; also return its release (s)."""
    from ...beyond_mocap.throws.join_throw import EASED, trim_waiting
    from ...beyond_mocap.throws.run_up import EDGE

    return trim_waiting(thrown.motion, thrown.release, EDGE if joined else EASED[order.act])


def _thrown(order: Order, target, own: "Motion", start: float, joined: bool, progress, cancelled) -> "Thrown":
    """Generate the throw at its position.

    At an armature without motion, it begins there; with a library, the body is where its own motion has it at the
    release; otherwise it begins where the own motion leads, since it is blended with that.
    """
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
    """Generate the throw with `where` as position of its start, its release or its ball."""
    from ...beyond_mocap.throws import throw, throw_order

    asked = throw_order.Order(target=tuple(target - [0.0, 0.0, order.lift]), limb=order.limb,
                              speed=order.speed or None, ball=order.kind, fps=order.fps, seed=order.seed, **where)
    return throw.throw_at(model, asked, order.skeleton, progress, cancelled)


def _seconds(thrown: "Thrown") -> float:
    """Find the s from the release at which the ball is nearest to where it passes the target."""
    from ...beyond_mocap.ball.flight import fly

    flight = fly(replace(thrown.launch, time=0.0), thrown.ball, LONGEST)
    times = np.arange(0.0, flight.end, 1.0 / 480.0)
    apart = np.linalg.norm(flight.at(times) - thrown.impact, axis=1)
    return float(times[int(np.argmin(apart))]) if np.all(np.isfinite(thrown.impact)) else _GUESS


def _share(progress, low: float, high: float):
    """Build a progress function for a part of the progress bar."""
    return lambda done, text: progress(low + (high - low) * done, text)
