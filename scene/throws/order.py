"""What is asked of an armature, as plain values; and the throw that comes of it, worked out in any thread.

Seconds are scene frames over the scene's rate, so the throw's frames are the scene's.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...beyond_mocap.errors import InputError
from .. import action, armature, channels, linked, preferences, session
from ..measure import frames_per_second, units_per_metre
from ..passes import possession
from ..settings import absolute
from . import rigged
from .settings import LIMBS, USUAL

FOLLOWED, LONGEST = 3.0, 10.0
"""Seconds that the ball is followed behind the target, bouncing and rolling, and that it takes to get there at most."""

if TYPE_CHECKING:
    from ...beyond_mocap.ball.flight import Flight
    from ...beyond_mocap.joined_throw import Joined
    from ...beyond_mocap.library.library import Library
    from ...beyond_mocap.motion.motion import Motion
    from ...beyond_mocap.motion.skeleton import Skeleton
    from ...beyond_mocap.throw import Thrown


@dataclass(frozen=True, eq=False)
class Order:
    """One throw or kick.

    body: the armature's name. act: "throw" or "kick". skeleton: the armature's; of a control rig, that of the bones that
    `table` (part -> bone) names, and lift: m that its soles are thicker than that skeleton's. own: what it plays, in the scene's
    metres, None where it only stands; first: the scene frame with which that begins. place (2,) m and facing rad: where
    an armature without a motion stands. target (3,) m. at: s of the release. speed: m/s, 0 as usual. ball_place: (3,) m
    where a ball that is kicked lies, None where it suits. model: a file, "" for what comes with the extension. folder:
    the library's, "" for none; build: how it is built.
    """

    body: str
    act: str
    limb: str
    skeleton: "Skeleton"
    table: dict[str, str]
    lift: float
    fps: float
    own: "Motion | None"
    first: int
    place: np.ndarray
    facing: float
    target: np.ndarray
    at: float
    speed: float
    kind: str
    ball_place: np.ndarray | None
    model: str
    seed: int
    folder: str
    unit: float | None
    library: "Library | None"
    build: dict = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Result:
    """What came of an order: the throw, the whole motion that shows it, the ball's way from the release on (seconds 0), seconds
    until it passes the target, and m/s^3 of the seams and what is usual there."""

    order: Order
    thrown: "Thrown"
    joined: "Joined"
    flight: "Flight"
    seconds: float
    library: "Library | None"
    jerk: float
    usual_jerk: float


def order_of(scene: bpy.types.Scene, body: bpy.types.Object, act: str) -> Order:
    """What an armature's settings ask for; InputError where that makes no sense, or where it cannot be animated."""
    wish, common = body.beyond_mocap_throw, scene.beyond_mocap
    check(scene, body)
    fps, rig = frames_per_second(scene), rigged.rig_of(scene, body)
    skeleton = armature.skeleton_of(body, scene) if rig is None else rig.skeleton
    own, first = _own(scene, body) if rig is None else rigged.own(scene, body)
    place, facing = _stands(scene, body, skeleton) if rig is None else rigged.stands(rig)
    limb = f"{wish.side}_{LIMBS[act]}"
    model = wish.throw_model if act == "throw" else wish.kick_model
    folder = absolute(common.library_folder) if wish.library and common.library_folder else ""
    unit = common.library_unit or None
    return Order(
        body=body.name, act=act, limb=limb, skeleton=skeleton, table=rig.table if rig is not None else {},
        lift=rigged.lift(rig) if rig is not None and act == "throw" else 0.0, fps=fps, own=own, first=first, place=place,
        facing=facing, target=_target(scene, wish), at=(wish.frame or scene.frame_current) / fps, speed=wish.speed,
        kind=USUAL[act] if wish.kind == "usual" else wish.kind, ball_place=_lies(scene, wish) if act == "kick" else None,
        model=absolute(model) if model else "", seed=wish.seed, folder=folder, unit=unit,
        library=session.library(folder, unit) if folder else None, build=preferences.for_build(folder) if folder else {},
    )


def check(scene: bpy.types.Scene, body: bpy.types.Object) -> None:
    """InputError where an armature or its ball cannot be animated here."""
    wish = body.beyond_mocap_throw
    linked.refuse(body, wish.ball)
    channels.check_free(body)
    override = body.override_library
    if override is not None and override.is_system_override:
        raise InputError(f"armature {body.name}", "an override that cannot be edited", "an editable override",
                         "make it editable: Outliner, Library Override, Make")
    if body.beyond_mocap_ride.on:
        raise InputError(f"armature {body.name}", "its motion rides a path", "an armature that does not",
                         "press Keep or Leave first")
    if body.mode == "EDIT":
        raise InputError(f"armature {body.name}", "its bones are being edited", "object or pose mode",
                         "leave edit mode (Tab)")
    ball = wish.ball
    if ball is None:
        return
    channels.check_free(ball)
    possession.check_unaimed(ball)
    ours = ball == wish.flown
    if ball.parent is not None or not ours and (len(ball.beyond_mocap_ball.holds) or len(ball.constraints)):
        found = "it has a parent, a constraint or is carried"
        raise InputError(f"ball {ball.name}", found, "a ball of its own", "free the ball first")


def work(order: Order, progress, cancelled, _hurry) -> Result:
    """The throw, and the motion it is part of. Never touches bpy."""
    from ...beyond_mocap import joined_throw
    from ...beyond_mocap.ball.flight import fly
    from ...beyond_mocap.library.library import build
    from ...beyond_mocap.motion.retarget import Retargeter

    library = order.library
    if order.folder and library is None:
        library = build(order.folder, unit=order.unit, **order.build, progress=progress, cancelled=cancelled)
    own = order.own
    if own is None:
        own = joined_throw.standing(order.skeleton, 0.0, order.fps, order.place, order.facing)
    elif order.table:
        own = Retargeter(own, order.skeleton, keeps_travel=True).carry(own)
    start = order.first / order.fps
    thrown = _thrown(order, own, start, library is not None, _share(progress, 0.0, 0.3), cancelled)
    motion, release = thrown.motion, thrown.release
    told = ()
    if library is not None:
        way = joined_throw.around(
            library, own, start, motion, release, order.at, order.act, _share(progress, 0.3, 1.0), cancelled
        )
        own, start, told = way.motion, way.start, way.warnings
    joined = joined_throw.laid_into(own, start, motion, release, order.at, goes_on=library is None)
    usual = joined_throw.usual_jerk(library, order.fps) if library is not None else float("nan")
    joined = replace(joined, warnings=(*told, *joined.warnings))
    up = np.array([0.0, 0.0, order.lift])
    raised = replace(joined.motion, root_positions=joined.motion.root_positions + up)
    joined = replace(joined, motion=raised)
    launch = replace(thrown.launch, time=0.0, position=thrown.launch.position + up)
    seconds = _seconds(fly(launch, thrown.ball, LONGEST), thrown.impact + up)
    flight = fly(launch, thrown.ball, seconds + FOLLOWED)
    return Result(order, thrown, joined, flight, seconds, library, float(joined_throw.seam_jerk(joined).max()), usual)


def _thrown(order: Order, own: "Motion", start: float, joined: bool, progress, cancelled) -> "Thrown":
    """The throw where it has to be: begun where an armature that only stands is; over where its own motion has it at
    the release, if a library joins them; else begun where its own motion leads, since it is eased out of that."""

    from ...beyond_mocap.joined_throw import comes_in_time, stops_at

    def spot(seconds: float) -> tuple[float, ...]:
        return tuple(own.root_positions[int(np.clip(round((seconds - start) * own.fps), 0, len(own) - 1)), :2])

    model = _model(order)
    if order.ball_place is not None:
        return _thrown_from(order, model, {"ball_place": tuple(order.ball_place)}, progress, cancelled)
    if order.own is None:
        return _thrown_from(order, model, {"start": tuple(order.place)}, progress, cancelled)
    thrown = _thrown_from(order, model, {"over": spot(order.at)}, progress, cancelled)
    begin = order.at - thrown.release
    if not joined:
        return _thrown_from(order, model, {"start": spot(begin)}, progress, cancelled)
    if comes_in_time(own, start, thrown.motion, thrown.release, order.at):
        return thrown
    return _thrown_from(order, model, {"start": tuple(stops_at(own, start, begin))}, progress, cancelled)


def _model(order: Order):
    """The trained model that is asked for."""
    from ...beyond_mocap.files.network_npz import read_model
    from ...beyond_mocap.throw import shipped_model

    return read_model(order.model) if order.model else shipped_model(order.act)


def _thrown_from(order: Order, model, where: dict, progress, cancelled) -> "Thrown":
    """The throw that begins, or is at its release, or finds the ball, `where`."""
    from ...beyond_mocap import throw

    asked = throw.Order(
        target=tuple(order.target - [0.0, 0.0, order.lift]), limb=order.limb, speed=order.speed or None, ball=order.kind, fps=order.fps,
        seed=order.seed, **where,
    )
    return throw.throw_at(model, asked, order.skeleton, progress, cancelled)


def _seconds(flight: "Flight", place: np.ndarray) -> float:
    """When a ball is nearest to a place (3,) m."""
    times = np.arange(0.0, flight.end, 1.0 / 480.0)
    apart = np.linalg.norm(flight.at(times) - place, axis=1)
    return float(times[int(np.argmin(apart))]) if np.all(np.isfinite(place)) else 1.0


def _share(progress, low: float, high: float):
    """A progress that fills a part of the bar."""
    return lambda done, text: progress(low + (high - low) * done, text)


def _own(scene: bpy.types.Scene, body: bpy.types.Object) -> tuple["Motion | None", int]:
    """What an armature plays without its throw, and the scene frame of its first pose; (None, first frame) where it
    plays nothing."""
    before = body.beyond_mocap_throw.before
    if before.kept:
        found = before.action
        slot = next((one for one in found.slots if one.identifier == before.slot), None) if found else None
    else:
        found, slot = channels.playing(body)
    curves = channels.curves(found, slot) if slot is not None else {}
    ends = channels.keyed_range({key: curve for key, curve in curves.items() if key[0].startswith("pose.bones")})
    if ends is None:
        return None, scene.frame_start
    motion = action.read(body, scene, found, slot)
    if not (np.isfinite(motion.root_positions).all() and np.isfinite(motion.rotations).all()):
        raise InputError(f"armature {body.name}", "a pose that is no number", "numbers", "look at its keys")
    return motion, ends[0]


def _stands(scene: bpy.types.Scene, body: bpy.types.Object, skeleton: "Skeleton") -> tuple[np.ndarray, float]:
    """Where an armature without a motion stands, (2,) m, and which way it faces, rad."""
    from ...beyond_mocap.motion import quaternion
    from ...beyond_mocap.motion.humanoid import heading_from_positions
    from ...beyond_mocap.motion.motion import pose_kinematics

    lie = armature.placement(body, scene)
    local = quaternion.identity(len(skeleton))
    local[0] = lie.rotation
    places, _ = pose_kinematics(skeleton, np.zeros(3), local)
    root = lie.to_world(np.array([body.data.bones[skeleton.names[0]].head_local]))[0]
    return np.asarray(root[:2]), float(heading_from_positions(skeleton, places))


def _target(scene: bpy.types.Scene, wish) -> np.ndarray:
    """(3,) m."""
    metres = 1.0 / units_per_metre(scene)
    if wish.target is not None and wish.target.name not in scene.objects:
        raise InputError("target", f"{wish.target.name} is not in this scene", "an object of this scene", "pick another")
    place = np.array(scene.cursor.location if wish.target is None else wish.target.matrix_world.translation) * metres
    if place[2] < 0.0:
        raise InputError("target", f"{-place[2]:.2f} m below the ground", "one on or above it, where balls get", "raise it")
    return place


def _lies(scene: bpy.types.Scene, wish) -> np.ndarray | None:
    """(3,) m where the user's ball lies that is to be kicked."""
    ball = wish.ball
    if ball is None:
        return None
    if ball.name not in scene.objects:
        raise InputError("ball", f"{ball.name} is not in this scene", "a ball of this scene", "pick another")
    from .flown import own_place

    return own_place(scene, ball, wish)
