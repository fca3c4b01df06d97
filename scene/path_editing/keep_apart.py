"""Collision avoidance of edited bodies: who comes too near each other, or another body, and what they change.

Changes are part of a path edit's settings: seconds added to its delay, and detours of its path. They are computed each
time from the curves as drawn and the delays that the user chose. Edited bodies also avoid bystanders: bodies of the
scene without a path, such as those of applied edits and of players.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from time import perf_counter

import bpy
import numpy as np

from ...beyond_mocap.base.errors import BeyondMocapError, InputError
from ..core import channels
from ..core.measure import frames_per_second, units_per_metre
from ..rigs.bone_curves import is_carried
from . import curve, riders, rig_look, rig_parts
from .carrier import MARK, read_source, recheck_sources
from .rig_source import Played, playing_strips
from .rigs import carrier_of, rides_as_rig
from .settings import riders as all_riders
from .settings import wishes

_ROUNDS = 2  # the second with a larger distance, for what the search does not compute exactly

HIPS = 0.9  # metres of hips above the ground, about: only decides whether bodies are on the same floor
_A_SECOND = 5  # samples of a rig in a second
_PATIENCE = 4.0  # seconds for all bystanders


@dataclass(frozen=True, eq=False)
class Trial:
    """What is needed to compute a body with another delay and other detours; no Blender data.

    Attributes:
        name: of the body.
        first: scene frame of the first frame.
        known: `PathEditSource` of the core.
        path: the new path.
        settings: `PathEditSettings` of the core.
        ground: the terrain, or None.
    """

    name: str
    first: int
    known: object
    path: object
    settings: object
    ground: object

    def follower(self, change, may_change: bool = True):
        """Compute the body with a `PathChange` as a follower of the core; its feet are not planted."""
        from ...beyond_mocap.path_editing.detour import Follower
        from ...beyond_mocap.path_editing.ride import ride

        settings = replace(self.settings, delay=self.settings.delay + change.delay, detours=change.detours, plant=False)
        ridden = ride(self.known, self.path, settings, self.ground)
        times = (self.first + np.arange(len(ridden.motion))) / ridden.motion.fps
        places = np.column_stack([ridden.motion.root_positions[:, :2], ridden.origin[:, 2]])
        if not may_change:
            return Follower(name=self.name, times=times, places=places)
        return Follower(name=self.name, times=times, places=places, path=self.path, arc=ridden.arc,
                        by_arc=self.settings.by_arc_length)


@dataclass(frozen=True)
class Kept:
    """The result of collision avoidance.

    Attributes:
        bodies: names of the edited bodies, in the order of changes.
        before: number of initial collisions.
        changes: one `PathChange` a body.
        unresolved: messages about collisions that remain, and about bodies that are left out.
    """

    bodies: tuple[str, ...]
    before: int
    changes: tuple
    left: tuple[str, ...]


def worked_out(context: bpy.types.Context, bodies: list[bpy.types.Object], limits) -> Kept:
    """Compute the changes that keep edited bodies apart; the scene stays as it is.

    All other edited bodies keep their motion, and so do bystanders.

    Args:
        context: for scene and view layer.
        bodies: the edited bodies that can yield.
        limits: `Limits` of the core.
    Returns:
        The changes and messages.
    Raises:
        InputError: if a body cannot follow its path.
    """
    from ...beyond_mocap.path_editing.apart import resolved
    from ...beyond_mocap.path_editing.detour import Change

    scene = context.scene
    context.view_layer.update()
    recheck_sources()
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
    """Apply changes to edited bodies and update them. Raises InputError, and restores everything, if one cannot
    follow.
    """
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
    """Describe the change of each body, and the remaining collisions."""
    return [line for line in map(_asked, kept.bodies, kept.changes) if line] + list(kept.left)


def _trial(scene, body) -> Trial:
    """Build the trial of a body without its previous changes."""
    from ...beyond_mocap.path_editing.ride import RideSettings

    ride, carrier = body.beyond_mocap_ride, carrier_of(body)
    carrier.check()
    settings = RideSettings(**{**wishes(ride), "detours": (), "delay": round(_own_delay(ride), 6)})
    known = read_source(carrier, scene, settings)
    ground = curve.ground_of(scene, ride.ground, curve.ground_digest(scene, ride.ground))
    return Trial(body.name, known.read.first, known.core, path=curve.read(scene, ride.curve).path(), settings=settings,
                 ground=ground)


def _own_delay(ride) -> float:
    """Compute the delay that the user chose."""
    return max(ride.delay - ride.added, 0.0)


def _others(scene, bodies) -> list:
    """Compute the other edited bodies as they are; those that cannot follow their path now are ignored."""
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
    """Find the collisions of bodies as they are."""
    from ...beyond_mocap.path_editing.collisions import collisions

    times = np.unique(np.concatenate([follower.times for follower in followers]))
    places = np.stack([follower.at(times) for follower in followers])
    return collisions(times, places, limits.distance, limits.height)


def _whole_frames(change, trial):
    """Round the wait of a change up to whole frames, as edited bodies wait."""
    fps = trial.known.motion.fps
    return replace(change, delay=float(np.ceil(round(change.delay * fps, 3)) / fps))


def _asked(name, change) -> str:
    parts = [f"waits {change.delay:.2f} s"] if change.delay else []
    ways = _joined(change.detours)
    sides = {True: "left", False: "right"}
    parts += [f"moves {abs(offset):.2f} m to the {sides[offset > 0]} at {arc:.1f} m" for arc, offset in ways]
    return f"{name} {', '.join(parts)}" if parts else ""


def _joined(detours) -> list[tuple[float, float]]:
    """List (arc, offset) of detours; consecutive ones that form one long detour only once, at its start."""
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


def bystanders(context: bpy.types.Context, patience: float = _PATIENCE) -> tuple[list, list[str]]:
    """Compute followers of the core that cannot yield: players' bodies and other visible animated armatures.

    Args:
        context: for scene and view layer.
        patience: seconds after which bodies are left out.
    Returns:
        The followers, and a message for each body that is left out: for lack of time, or because it cannot be read.
    """
    begun, found, left = perf_counter(), [], []
    for body in sorted(_bodies(context), key=rides_as_rig):  # the quick ones first
        try:
            found.append(_follower(context.scene, body, begun + patience))
        except BeyondMocapError as error:
            left.append(f"{body.name} is left out: {error}")
    return found, left


def _bodies(context) -> list[bpy.types.Object]:
    scene, layer = context.scene, context.view_layer
    players = {player.body.name for player in scene.beyond_mocap.players if player.body is not None}
    found = [body for body in scene.objects if body.type == "ARMATURE" and not body.beyond_mocap_ride.on]
    return [body for body in found if (channels.playing(body)[0] is not None or playing_strips(body))
            and (body.name in players or body.visible_get(view_layer=layer) and not _hangs_on_rider(body))]


def _hangs_on_rider(body) -> bool:
    """Return whether an armature copies an edited body, as a character retargeted from it does."""
    constraints = [one for thing in (body, *body.pose.bones) for one in thing.constraints if not one.mute]
    holders = [getattr(one, "target", None) for one in constraints]
    while body.parent is not None:
        body = body.parent
        holders.append(body)
    return any(one is not None and one.type == "ARMATURE" and one.beyond_mocap_ride.on for one in holders)


def _follower(scene, body, until: float):
    """Compute the place of a body's hips over the ground. Raises InputError after the time `until`."""
    from ...beyond_mocap.path_editing.detour import Follower

    if perf_counter() > until:
        raise _late()
    try:
        if rides_as_rig(body):
            raise InputError(body.name, "is a rig")
        read = carrier_of(body).read(scene)
        frames, hips = read.first + np.arange(len(read.motion)), read.motion.root_positions
    except BeyondMocapError:  # sample it instead
        frames, hips = _looked_at(scene, body, until)
    if not np.isfinite(hips).all():
        raise InputError("its pose", "a place with NaN or infinite values", "finite values", "check its keys")
    return Follower(name=body.name, times=frames / frames_per_second(scene), places=hips - (0.0, 0.0, HIPS))


def _looked_at(scene, body, until: float) -> tuple[np.ndarray, np.ndarray]:
    """Sample some frames (F,) and the hips on them (F, 3), metres; the middle of all bones without hips."""
    frames = _frames(scene, body)
    parts = rig_parts.of_rig(body)
    names = [parts.shown["hips"]] if parts else [bone.name for bone in body.data.bones]
    rows = []
    with rig_look.alone(body, scene) as side:
        for frame in frames:
            if perf_counter() > until:
                raise _late()
            side.frame_set(int(frame))
            shown = body.evaluated_get(side.view_layers[0].depsgraph)
            middle = np.mean([shown.pose.bones[name].head[:] for name in names], axis=0)
            rows.append(np.array(shown.matrix_world) @ [*middle, 1.0])
    return frames, np.array(rows)[:, :3] / units_per_metre(scene)


def _frames(scene, body) -> np.ndarray:
    """Choose whole frames from the first to the last of a motion, about `_A_SECOND` in a second."""
    try:
        played = Played(body, scene).frames
        first, last = int(played[0]), int(played[-1])
    except BeyondMocapError:  # a pose alone
        first = last = scene.frame_start
    if is_carried(body):
        first, last = min(first, scene.frame_start), max(last, scene.frame_end)
    step = max(int(frames_per_second(scene) / _A_SECOND), 1)
    return np.unique([*range(first, last, step), last, last + (first == last)])


def _late() -> InputError:
    found, expected = "takes too long to sample", "a faster rig"
    return InputError("its rig", found, expected, "hide bodies that are not needed, or bake its motion")
