"""Start, update, apply and revert path edits of armatures; the work behind the buttons."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property

import bpy
import numpy as np

from ...beyond_mocap.base.digest import byte_digest
from ...beyond_mocap.base.errors import BeyondMocapError, InputError
from ..core import channels
from ..core.set_aside import drop, play_as_before
from . import curve, keys
from .carrier import MARK, forget_sources, read_source, recheck_sources
from .rigs import carrier_of
from .settings import choose, riders, wishes

_SAMPLES = 400
MOST_FRAMES = 40_000  # of a cycled motion, about: it is computed at every change, and more would take minutes


@dataclass(frozen=True, eq=False)
class Shown:
    """The computed path edit of an armature: plain values, metres in the scene's world.

    Attributes:
        first: scene frame of the first frame.
        fps: frames per second.
        source: `PathEditSource` of the core.
        path: the new path.
        edited: `EditedMotion` of the core.
        number: a counter, new for each computation.
        messages: lines for the user.
    """

    first: int
    fps: float
    source: object
    path: object
    ridden: object
    number: int
    told: str = ""

    @cached_property
    def source_line(self) -> np.ndarray:
        """(N, 3) metres, the original path."""
        return _along(self.source.path)

    @cached_property
    def line(self) -> np.ndarray:
        """(N, 3) metres, the new path."""
        return _along(self.path)

    def frames(self, frame: float) -> tuple[int, int]:
        """Compute the edited frame at a scene frame and the original frame that it displays, both within range."""
        own = int(np.clip(round(frame - self.first), 0, len(self.ridden.motion) - 1))
        return own, int(np.clip(round(self.ridden.frames[own]), 0, len(self.source.motion) - 1))


_shown: dict[int, tuple[str, Shown]] = {}  # by session_uid of the armature: digest and result
_counted = 0


def forget() -> None:
    """Clear all caches when another file is opened."""
    _shown.clear()
    forget_sources()
    curve.forget_grounds()
    keys.forget()


def anybody_shown() -> bool:
    """Return whether any path edit has been computed; fast, since every redraw calls it."""
    return bool(_shown)


def shown(body: bpy.types.Object) -> Shown | None:
    """Find the last computed path edit of an armature; None if this session has none."""
    digest, known = _shown.get(body.session_uid, ("", None))
    if known is None or not body.beyond_mocap_ride.on:
        return None
    played = channels.playing(body)[0]
    return known if played is not None and played.get(MARK) == digest else None  # undo may have restored another


def renew(scene: bpy.types.Scene, body: bpy.types.Object, anew: bool = False) -> bool:
    """Update an armature's motion from its curve and settings.

    Args:
        scene: of the armature.
        body: the edited armature.
        force: check all sources again and write the motion even if it seems unchanged.
    Returns:
        Whether anything was computed.
    Raises:
        InputError: if it cannot be computed at present; the motion stays as it was.
    """
    from ...beyond_mocap.path_editing.ride import RideSettings, ride

    global _counted
    ridden_by, carrier = body.beyond_mocap_ride, carrier_of(body)
    carrier.check()
    if anew:
        bpy.context.view_layer.update()
        recheck_sources()
        keys.refresh()
    settings, drawn = RideSettings(**wishes(ridden_by)), curve.read(scene, ridden_by.curve)
    known = read_source(carrier, scene, settings)
    ground = curve.ground_digest(scene, ridden_by.ground)
    digest = byte_digest(known.digest, drawn.digest, ground, repr(settings)).hex()
    made = carrier.ours()[0]
    up_to_date, remembered = made[MARK] == digest, _shown.get(body.session_uid, ("", None))[0] == digest
    if up_to_date and remembered and not anew:
        lines = _lines(scene, ridden_by, digest, _shown[body.session_uid][1])
        tell(ridden_by, lines)  # removes messages about problems that are solved
        return False
    path = drawn.path()
    _check_length(known.core, path, settings)
    ridden = ride(known.core, path, settings, curve.ground_of(scene, ridden_by.ground, ground))
    if anew or not up_to_date:
        carrier.write(scene, known.read, ridden, digest)
    _counted += 1
    first, fps = known.read.first, known.read.motion.fps
    told = "\n".join((*drawn.notes, *curve.ground_notes(ridden_by.ground), *known.read.told, *ridden.warnings))
    now = Shown(first, fps, known.core, path=path, ridden=ridden, number=_counted, told=told)
    _shown[body.session_uid] = digest, now
    tell(ridden_by, _lines(scene, ridden_by, digest, now), _figures(known.core, ridden))
    return True


def _lines(scene: bpy.types.Scene, ride, digest: str, now: Shown) -> str:
    """Build the messages of a path edit, also where it ends beyond the scene, or changed since collisions were
    avoided.
    """
    lines, last = [now.told] if now.told else [], now.first + len(now.ridden.motion) - 1
    if last > max(scene.frame_end, now.first + len(now.source.motion) - 1):
        lines.append(f"the motion ends at frame {last}, after the end of the scene at {scene.frame_end}")
    if ride.agreed not in ("", digest):
        lines.append("changed since Avoid Collisions: press it again")
    return "\n".join(lines)


def _check_length(known, path, settings) -> None:
    """Raise InputError if a cycled motion would become too long."""
    if not settings.cycle or known.arc.length <= 0.0:
        return
    metres, motion = np.linalg.norm(np.diff(_along(path), axis=0), axis=1).sum(), known.motion
    frames = len(motion) * metres / known.arc.length / settings.speed
    if frames > MOST_FRAMES:
        found = f"the motion takes {frames / motion.fps / 60.0:.0f} minutes on a path of {metres:.0f} m"
        raise InputError("cycle", found, f"{MOST_FRAMES / motion.fps / 60.0:.0f} minutes or less",
                         "shorten the path, or switch Cycle off")


def begin(
    context: bpy.types.Context, body: bpy.types.Object, drawn: bpy.types.Object | None = None, count: int = 0,
    kind: str = "BEZIER", degree: int = 3, straight: bool = False,
) -> bpy.types.Object:
    """Start a path edit: on a given curve, or on a new one along the armature's own path; its action is stored.

    Args:
        context: for scene and view layer.
        body: the armature.
        drawn: a curve object; None to create one.
        count, kind, degree, straight: of a new curve, see `curve.create_curve`.
    Returns:
        The curve object.
    Raises:
        InputError: if the armature cannot be edited; nothing is changed.
    """
    from ...beyond_mocap.path_editing.ride import RideSettings

    scene, ride, carrier = context.scene, body.beyond_mocap_ride, carrier_of(body)
    if ride.on:
        raise InputError(f"armature {body.name}", "already follows a path", "an armature without a path edit",
                         "edit its curve, or press Revert")
    carrier.check()
    context.view_layer.update()
    recheck_sources()
    known = read_source(carrier, scene, RideSettings(**wishes(ride))).core
    before = ride.curve
    if drawn is None and not (straight or count) and before is not None and before.name in scene.objects:
        drawn = before
    made = None
    if drawn is None:
        made = drawn = curve.create(context, f"{body.name} path", *_own_path(known, straight), count, kind, degree)
    else:
        curve.read(scene, drawn).path()
    carrier.begin()
    ride.on, ride.curve = True, drawn
    try:
        renew(scene, body)
    except BeyondMocapError:
        revert(body, before, made)
        raise
    return drawn


def revert(body: bpy.types.Object, before: bpy.types.Object | None, made: bpy.types.Object | None) -> None:
    """Undo `start_path_edit`: restore the previous curve and remove the one created for the edit."""
    end(body)
    body.beyond_mocap_ride.curve = before
    if made is not None:
        bpy.data.curves.remove(made.data)


def change(scene: bpy.types.Scene, body: bpy.types.Object, drawn: bpy.types.Object) -> None:
    """Let an edited armature follow another curve. Raises InputError, and changes nothing, where it cannot."""
    ride = body.beyond_mocap_ride
    before, ride.curve = ride.curve, drawn
    try:
        renew(scene, body)
    except BeyondMocapError:
        ride.curve = before
        raise


def new_curve(
    context: bpy.types.Context, body: bpy.types.Object, shape: str = "FITTED", count: int = 0, kind: str = "BEZIER",
    degree: int = 3,
) -> bpy.types.Object:
    """Create another curve for an edited armature and let it follow that.

    The previous curve is removed if the extension created it and no other armature follows it.

    Args:
        context: for scene and view layer.
        body: the edited armature.
        shape: one of `curve.SHAPES`.
        count, kind, degree: of the new curve, see `curve.create_curve`.
    Returns:
        The new curve object.
    Raises:
        InputError: if the motion cannot follow it; nothing is changed.
    """
    from ...beyond_mocap.path_editing.ride import RideSettings

    scene, ride = context.scene, body.beyond_mocap_ride
    before = ride.curve
    if shape == "PRESENT":
        path, straight = curve.read(scene, before).path(), False
    else:
        settings = RideSettings(**wishes(ride))
        path, straight = _own_path(read_source(carrier_of(body), scene, settings).core, shape == "STRAIGHT")
    made = curve.create(context, f"{body.name} path", path, straight=straight, count=count, kind=kind, degree=degree)
    try:
        change(scene, body, made)
    except BeyondMocapError:
        bpy.data.curves.remove(made.data)
        raise
    ridden = any(rider.beyond_mocap_ride.curve == before for rider in riders(scene))
    if before is not None and before.get(curve.MARK) and not ridden:
        name = before.name
        curve.remove_curve(before)
        made.name = made.data.name = name
    return made


def keep(scene: bpy.types.Scene, body: bpy.types.Object) -> tuple[bpy.types.Action, str]:
    """Apply a path edit: the edited motion becomes an ordinary action; the original action stays in the file.

    If the motion cannot be updated, its last state is applied.

    Returns:
        The action, and why it is not up to date ("" if it is).
    """
    ride, carrier, told = body.beyond_mocap_ride, carrier_of(body), ""
    may_keep(body)
    try:
        renew(scene, body)
    except BeyondMocapError as error:
        told = str(error)
    made = carrier.ours()[0]
    original, drawn = ride.before.action, ride.curve
    carrier.settle()
    play_as_before(ride.before, body.animation_data)
    drop(ride.before, MARK)
    del made[MARK]
    name = original.name if original is not None else body.name
    made.name = f"{name} on {drawn.name}" if drawn is not None else f"{name} path motion"
    _over(ride)
    return made, told


def may_end(body: bpy.types.Object) -> None:
    """Raise InputError if an armature's original motion cannot be restored here."""
    channels.check_local(body)
    channels.check_free(body)


def may_keep(body: bpy.types.Object) -> None:
    """Raise InputError if an armature's edited motion cannot be applied here."""
    may_end(body)
    carrier_of(body).ours()


def end(body: bpy.types.Object) -> None:
    """Revert a path edit: the armature plays its original motion again, bit for bit."""
    carrier_of(body).end()
    _over(body.beyond_mocap_ride)


def leave(*bodies: bpy.types.Object | None) -> list[str]:
    """Revert the path edits among these armatures before another edit of them; returns a message for each."""
    riding = [body for body in bodies if body is not None and body.beyond_mocap_ride.on]
    for body in riding:
        may_end(body)
    for body in riding:
        end(body)
    return [f"{body.name}: path edit reverted; its curve stays, press Edit Path to use it again" for body in riding]


def standing(body: bpy.types.Object | None):
    """Build a function from scene frames (F,) to foot contacts (F, 2) of an edited armature; None where unknown."""
    now = shown(body) if body is not None else None
    if now is None:
        return None
    stands = now.ridden.standing.any(axis=2)

    def at(frames: np.ndarray) -> np.ndarray:
        rows = np.round(frames).astype(int) - now.first
        return stands[np.clip(rows, 0, len(stands) - 1)] & ((rows >= 0) & (rows < len(stands)))[:, None]

    return at


def back_to(context: bpy.types.Context, bodies: list[bpy.types.Object]) -> None:
    """Select the armatures again if an active curve is no longer the path of any armature."""
    active = context.view_layer.objects.active
    if context.mode != "OBJECT" or active is None or active.type != "CURVE":
        return
    if any(body.beyond_mocap_ride.curve == active for body in riders(context.scene)):
        return
    choose(context, bodies[0])
    for body in bodies:
        if body.name in context.view_layer.objects:
            body.select_set(True)


def _own_path(known, straight: bool):
    """Choose the path of a new curve, and whether it is straight: two metres straight ahead for a motion in place."""
    from ...beyond_mocap.motion.path.path import SplinePath
    from ...beyond_mocap.path_editing.path_line import SHORTEST

    if known.arc.length >= 2.0 * SHORTEST:
        return known.path, straight
    start, yaw = known.moving.origin[0], known.moving.heading[0]
    ends = np.array([start, start + 2.0 * np.array([np.cos(yaw), np.sin(yaw), 0.0])])
    return SplinePath(np.array([0.0, 0.0, 1.0, 1.0]), ends, 1), True


def _figures(known, ridden) -> dict:
    """Summarize a result for the panel, in metres and seconds."""
    motion = ridden.motion
    return {"seconds": round(motion.duration, 3), "source_seconds": round(known.motion.duration, 3),
            "metres": round(float(ridden.arc[-1] - ridden.arc[0]), 3),
            "source_metres": round(float(known.arc.length), 3), "seams": len(ridden.seams),
            "correction": round(float(np.percentile(ridden.correction, 95)), 4),
            "miss": round(float(ridden.miss.max(initial=0.0)), 4)}


def tell(ride, lines: str, figures: dict | None = None) -> None:
    """Store messages, such as why a motion cannot follow its path, and figures for the panel.

    Only changes are written, since each write changes the object and triggers another check.
    """
    if ride.told != lines:
        ride.told = lines
    text = json.dumps(figures) if figures is not None else ride.figures
    if ride.figures != text:
        ride.figures = text


def _over(ride) -> None:
    """End a path edit; a curve or ground that was deleted is not kept in the file."""
    ride.on = False
    ride.told = ride.figures = ""
    for name in ("curve", "ground"):
        thing = getattr(ride, name)
        if thing is not None and not thing.users_scene:
            setattr(ride, name, None)


def _along(path) -> np.ndarray:
    return path.at(np.linspace(*path.domain, _SAMPLES))
