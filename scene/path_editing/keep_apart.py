"""Riders keep apart: which of them come too near each other, or another body, and what each is asked to do about it.

What is asked is part of a rider's settings: seconds added to its delay, and detours of its path. Each time it is worked
out from the curves as they are drawn and the delays that the user chose.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...beyond_mocap.base.errors import BeyondMocapError
from ..core.measure import frames_per_second
from . import curve, riders, source
from .bystanders import bystanders
from .carrier import MARK
from .rigs import carrier_of
from .settings import riders as all_riders
from .settings import wishes

_ROUNDS = 2  # the second with room for what the search does not reckon with exactly


@dataclass(frozen=True, eq=False)
class Trial:
    """What it takes to work out where a rider is with another delay and other detours, nothing of Blender's."""

    name: str
    first: int
    known: object
    path: object
    settings: object
    ground: object

    def ridden(self, change):
        """The rider's motion with a `Change`; its feet do not matter here."""
        from ...beyond_mocap.path_editing.ride import ride

        settings = replace(self.settings, delay=self.settings.delay + change.delay, detours=change.detours, plant=False)
        return ride(self.known, self.path, settings, self.ground)

    def follower(self, change, may_change: bool = True):
        """The rider with a `Change` as a body of the core."""
        from ...beyond_mocap.path_editing.detour import Follower

        ridden = self.ridden(change)
        fps = ridden.motion.fps
        times = (self.first + np.arange(len(ridden.motion))) / fps
        places = np.column_stack([ridden.motion.root_positions[:, :2], ridden.origin[:, 2]])
        if not may_change:
            return Follower(name=self.name, times=times, places=places)
        return Follower(name=self.name, times=times, places=places, path=self.path, arc=ridden.arc,
                        by_arc=self.settings.by_arc_length)


@dataclass(frozen=True)
class Kept:
    """What came out. bodies: names of the riders, in the order of changes. before: how many collisions there were;
    changes: one `Change` a rider; left: lines about those that stay, and
    about who was left out."""

    bodies: tuple[str, ...]
    before: int
    changes: tuple
    left: tuple[str, ...]


def worked_out(context: bpy.types.Context, bodies: list[bpy.types.Object], limits) -> Kept:
    """What these riders have to do to keep apart within `limits` of the core; the scene stays as it is.

    All other riders stay where they are, and so do those who ride nowhere (see `bystanders`). InputError where a rider
    cannot ride.
    """
    from ...beyond_mocap.path_editing.apart import resolved
    from ...beyond_mocap.path_editing.detour import Change

    scene = context.scene
    context.view_layer.update()
    source.unsure()
    trials = [_trial(scene, body) for body in bodies]
    standing, unread = bystanders(context)
    fixed = _others(scene, bodies) + standing
    bare, changes, found = [trial.follower(Change()) for trial in trials], (Change(),) * len(trials), None
    wider, before = limits, 0
    for attempt in range(_ROUNDS):
        found = resolved([*bare, *fixed], wider)
        changes = tuple(_whole_frames(change, trial) for change, trial in zip(found.changes, trials))
        before = len(found.before) if attempt == 0 else before
        left = _met([trial.follower(change, False) for trial, change in zip(trials, changes)] + fixed, limits)
        left = [hit for hit in left if hit.first < len(trials)]
        given_up = {(hit.first, hit.second) for hit in found.left}
        short = [limits.distance - hit.gap for hit in left if (hit.first, hit.second) not in given_up]
        if not short:
            break
        wider = replace(wider, distance=wider.distance + max(short) + 0.01)
    names = [follower.name for follower in (*bare, *fixed)]
    lines = tuple(_line(hit, names, frames_per_second(scene)) for hit in left)
    return Kept(tuple(body.name for body in bodies), before, changes, (*lines, *unread))


def lay(scene: bpy.types.Scene, bodies: list[bpy.types.Object], changes) -> None:
    """Ask riders for these changes, instead of those before, and bring them up to date. InputError, and all as before,
    where one of them cannot follow."""
    from ...beyond_mocap.path_editing.detour import Change

    rides = [body.beyond_mocap_ride for body in bodies]
    before = [(ride.delay, ride.added, ride.detours, ride.agreed) for ride in rides]
    try:
        for ride, change in zip(rides, changes):
            ride.delay, ride.added, ride.agreed = _own_delay(ride) + change.delay, change.delay, ""
            ride.detours = json.dumps([list(detour) for detour in change.detours])
        for body in bodies:
            riders.renew(scene, body)
    except BeyondMocapError:
        for ride, (delay, added, detours, agreed) in zip(rides, before):
            ride.delay, ride.added, ride.detours, ride.agreed = delay, added, detours, agreed
        raise
    if any(change != Change() for change in changes):
        for body, ride in zip(bodies, rides):
            ride.agreed = str(carrier_of(body).ours()[0][MARK])


def lines_of(kept: Kept) -> list[str]:
    """What each rider is asked to do, and what stays."""
    return [line for line in map(_asked, kept.bodies, kept.changes) if line] + list(kept.left)


def _trial(scene, body) -> Trial:
    """A rider as it is without what it was asked before."""
    from ...beyond_mocap.path_editing.ride import RideSettings

    ride, carrier = body.beyond_mocap_ride, carrier_of(body)
    carrier.check()
    settings = RideSettings(**{**wishes(ride), "detours": (), "delay": round(_own_delay(ride), 6)})
    known = source.of(carrier, scene, settings)
    ground = source.ground_of(scene, ride.ground, source.ground_digest(scene, ride.ground))
    return Trial(body.name, known.read.first, known.core, path=curve.read(scene, ride.curve).path(), settings=settings,
                 ground=ground)


def _own_delay(ride) -> float:
    """The delay that the user chose."""
    return max(ride.delay - ride.added, 0.0)


def _others(scene, bodies) -> list:
    """Other riders as they are; those that cannot ride just now, which is told at them, stand in nobody's way."""
    from ...beyond_mocap.path_editing.detour import Change

    found = []
    for body in all_riders(scene):
        if body not in bodies:
            try:
                trial = _trial(scene, body)
            except BeyondMocapError:
                continue
            asked = Change(body.beyond_mocap_ride.added, wishes(body.beyond_mocap_ride)["detours"])
            found.append(trial.follower(asked, False))
    return found


def _met(followers, limits) -> list:
    """The collisions of bodies as they are."""
    from ...beyond_mocap.path_editing.collisions import collisions

    times = np.unique(np.concatenate([follower.times for follower in followers]))
    places = np.stack([follower.at(times) for follower in followers])
    return collisions(times, places, limits.distance, limits.height)


def _whole_frames(change, trial):
    """A change that waits for whole frames, as riders do."""
    fps = trial.known.motion.fps
    return replace(change, delay=float(np.ceil(round(change.delay * fps, 3)) / fps))


def _asked(name, change) -> str:
    parts = [f"waits {change.delay:.2f} s"] if change.delay else []
    ways = _joined(change.detours)
    sides = {True: "left", False: "right"}
    parts += [f"goes {abs(offset):.2f} m to the {sides[offset > 0]} at {arc:.1f} m" for arc, offset in ways]
    return f"{name} {', '.join(parts)}" if parts else ""


def _joined(detours) -> list[tuple[float, float]]:
    """(arc, offset) of detours; those side by side that make one long one only once, where it begins."""
    found, end = [], None
    for arc, width, offset in sorted(detours):
        if end is None or arc - 0.5 * width > end or not found or found[-1][1] != offset:
            found.append((max(arc, 0.0), offset))
        end = arc + 0.5 * width
    return found


def _line(hit, names, fps) -> str:
    frames = f"frames {round(hit.start * fps)} to {round(hit.end * fps)}"
    both = f"{names[hit.first]} and {names[hit.second]}"
    return f"{both} still come within {hit.gap:.2f} m at {hit.time:.2f} s ({frames})"
