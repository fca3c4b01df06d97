"""Generate the throw that a request asks for, in any thread: never uses bpy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..core import session
from .throw_task import ThrowTask

if TYPE_CHECKING:
    from ...beyond_mocap.ball.flight import Flight
    from ...beyond_mocap.library.library import Library
    from ...beyond_mocap.motion.motion import Motion
    from ...beyond_mocap.throws.join_throw import JoinedThrow
    from ...beyond_mocap.throws.throw_request import ThrowResult

FOLLOW_SECONDS, MAX_FLIGHT_SECONDS = 3.0, 10.0
"""Seconds of the ball's flight shown beyond the target, bouncing and rolling, and the longest flight to the target."""
# first estimate, s, of the flight to a moving target; largest number of corrections of it
_FIRST_ESTIMATE, _ROUNDS = 1.0, 5


@dataclass(frozen=True, eq=False)
class ThrowPreview:
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

    order: ThrowTask
    thrown: "ThrowResult"
    joined: "JoinedThrow"
    flight: "Flight"
    seconds: float
    library: "Library | None"
    jerk: float
    usual_jerk: float


def generate_throw(order: ThrowTask, progress, cancelled, _hurry) -> ThrowPreview:
    """Generate a throw, and the motion it is part of.

    Args:
        order: the request.
        progress: receives a share of 0 .. 1 and a text.
        cancelled: returns True to stop.
    """
    from ...beyond_mocap.ball.flight import simulate_flight
    from ...beyond_mocap.motion.retargeting.retarget import Retargeter
    from ...beyond_mocap.throws.join_throw import (
        FADE,
        FADE_WITHOUT_LIBRARY,
        build_standing_motion,
        join_throw,
        measure_library_jerk,
        measure_transition_jerk,
    )
    from ...beyond_mocap.throws.leave_path import leave_path

    library = session.open_library(order, progress, cancelled) if order.folder else order.library
    own_motion = order.own_motion
    if own_motion is None:
        own_motion = build_standing_motion(order.skeleton, 0.0, order.fps, order.place, order.facing)
    elif order.table:
        own_motion = Retargeter(own_motion, order.skeleton, keeps_travel=True).retarget(own_motion)
    start = order.first / order.fps
    original = order
    order, thrown, seconds = _generate_at_target(order, own_motion, start, joined=library is not None,
                                                 progress=_build_progress(progress, 0.0, 0.3), cancelled=cancelled)
    motion, release = _trim_throw(order, thrown, library is not None)
    warnings: tuple = ()
    if library is not None:
        run_up = leave_path(library, own_motion, start, motion, release, at=order.at, action=order.action,
                            progress=_build_progress(progress, 0.3, 1.0), cancelled=cancelled)
        own_motion, start, warnings = run_up.motion, run_up.start, run_up.warnings
    fade = FADE if library is not None else FADE_WITHOUT_LIBRARY[order.action]
    joined = join_throw(own_motion, start, motion, release, at=order.at, continues=library is None, fade=fade)
    usual = measure_library_jerk(library, order.fps) if library is not None else float("nan")
    joined = replace(joined, warnings=(*_describe_timing(original, order, joined), *warnings, *joined.warnings))
    up = np.array([0.0, 0.0, order.sole_lift])
    raised_motion = replace(joined.motion, root_positions=joined.motion.root_positions + up)
    joined = replace(joined, motion=raised_motion)
    launch = replace(thrown.launch, time=0.0, position=thrown.launch.position + up)
    flight = simulate_flight(launch, thrown.ball, seconds + FOLLOW_SECONDS)
    return ThrowPreview(order, thrown, joined, flight=flight, seconds=seconds, library=library,
                        jerk=float(measure_transition_jerk(joined).max()), usual_jerk=usual)


def _generate_at_target(order: ThrowTask, own: "Motion", start: float, joined: bool, progress, cancelled):
    """Generate the throw, with release time and target adapted to it.

    The ball leaves later if the throw would begin before the scene and may wait, and a moving target is aimed at
    where it is on arrival.

    Returns:
        The adapted request, the throw, and the s of the ball's flight.
    """
    seconds = _FIRST_ESTIMATE
    for _ in range(_ROUNDS):
        target = order.targets[min(round(seconds * order.fps), len(order.targets) - 1)]
        thrown = _generate_placed(order, target, own, start=start, joined=joined, progress=progress,
                                  cancelled=cancelled)
        estimate, seconds = seconds, _find_flight_seconds(thrown)
        delay_frames = int(np.ceil((order.scene_start + _trim_throw(order, thrown, joined)[1] - order.at) * order.fps
                                   - 1e-6))
        if order.may_wait and delay_frames > 0:
            targets = order.targets[min(delay_frames, len(order.targets) - 1) :]
            order = replace(order, at=order.at + delay_frames / order.fps, targets=targets, may_wait=False)
        elif len(order.targets) == 1 or abs(seconds - estimate) * order.fps < 0.5:
            break
    return order, thrown, seconds


def _describe_timing(original: ThrowTask, order: ThrowTask, joined: "JoinedThrow") -> list[str]:
    """List warnings about a throw that begins before the scene."""
    first = round(order.scene_start * order.fps)
    begins = round(joined.start * order.fps) + joined.first
    if order.at != original.at:
        return [f"the ball leaves on frame {round(order.at * order.fps)}: with an earlier release the {order.action} "
                f"begins before the scene's first frame"]
    if begins >= first:
        return []
    frame = round(order.at * order.fps) + first - begins
    return [f"the {order.action} begins on frame {begins}, before the scene's first frame {first}: set Release Frame "
            f"to {frame} or more to see all of it"]


def _trim_throw(order: ThrowTask, thrown: "ThrowResult", joined: bool) -> tuple["Motion", float]:
    """Cut the waiting time from a throw, since a moving body does not stop; also return its release (s)."""
    from ...beyond_mocap.throws.join_throw import FADE_WITHOUT_LIBRARY, trim_waiting
    from ...beyond_mocap.throws.run_up import EDGE

    return trim_waiting(thrown.motion, thrown.release, EDGE if joined else FADE_WITHOUT_LIBRARY[order.action])


def _generate_placed(order: ThrowTask, target, own: "Motion", start: float, joined: bool, progress,
                     cancelled) -> "ThrowResult":
    """Generate the throw at its position.

    At an armature without motion, it begins there; with a library, the body is where its own motion has it at the
    release; otherwise it begins where the own motion leads, since it is blended with that.
    """
    from ...beyond_mocap.throws.leave_path import find_stopping_position, is_in_reach
    from ...beyond_mocap.throws.network_npz import read_chosen_model

    def find_root(seconds: float) -> tuple[float, ...]:
        return tuple(own.root_positions[int(np.clip(round((seconds - start) * own.fps), 0, len(own) - 1)), :2])

    model = read_chosen_model(order.model, order.action)
    throw = partial(_generate_from, order, target, model, progress=progress, cancelled=cancelled)
    if order.ball_place is not None:
        return throw(where={"ball_place": tuple(order.ball_place)})
    if order.own_motion is None:
        return throw(where={"start": tuple(order.place)})
    thrown = throw(where={"over": find_root(order.at)})
    motion, release = _trim_throw(order, thrown, joined)
    begin = order.at - release
    if not joined:
        return throw(where={"start": find_root(begin)})
    if is_in_reach(own, start, motion, release, order.at):
        return thrown
    return throw(where={"start": tuple(find_stopping_position(own, start, begin))})


def _generate_from(order: ThrowTask, target, model, where: dict, progress, cancelled) -> "ThrowResult":
    """Generate the throw with `where` as position of its start, its release or its ball."""
    from ...beyond_mocap.throws import throw
    from ...beyond_mocap.throws import throw_request as throw_order

    request = throw_order.ThrowRequest(target=tuple(target - [0.0, 0.0, order.sole_lift]), limb=order.limb,
                                       speed=order.speed or None, ball=order.kind, fps=order.fps, seed=order.seed,
                                       **where)
    return throw.throw_at(model, request, order.skeleton, progress, cancelled)


def _find_flight_seconds(thrown: "ThrowResult") -> float:
    """Find the s from the release at which the ball is nearest to where it passes the target."""
    from ...beyond_mocap.ball.flight import simulate_flight

    flight = simulate_flight(replace(thrown.launch, time=0.0), thrown.ball, MAX_FLIGHT_SECONDS)
    times = np.arange(0.0, flight.end, 1.0 / 480.0)
    distances = np.linalg.norm(flight.at(times) - thrown.impact, axis=1)
    return float(times[int(np.argmin(distances))]) if np.all(np.isfinite(thrown.impact)) else _FIRST_ESTIMATE


def _build_progress(progress, low: float, high: float):
    """Build a progress function for a part of the progress bar."""
    return lambda done, text: progress(low + (high - low) * done, text)
