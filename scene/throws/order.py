"""What is asked of an armature, as plain values; where what is aimed at is, or the way on which the ball meets it; what
the ball does before: keyed, thrown before, or carried by others for a while.

Seconds are scene frames over the scene's rate, so the throw's frames are the scene's.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Matrix

from ...beyond_mocap.base.errors import InputError
from ..core import action, channels, preferences, session
from ..core.measure import frames_per_second, units_per_metre
from ..core.set_aside import stance_of
from ..core.settings import absolute
from ..passes import possession
from ..path_editing.carrier import check_finite, refuse_system_override
from ..path_editing.rig_look import alone
from ..rigs import armature
from . import rigged
from .settings import LIMBS, USUAL, BeyondMocapThrow

if TYPE_CHECKING:
    from ...beyond_mocap.library.library import Library
    from ...beyond_mocap.motion.motion import Motion
    from ...beyond_mocap.motion.skeleton import Skeleton

TARGET_SECONDS = 8.0  # seconds from the release on in which a target's own way counts
_STILL = 1e-3  # m that a target moves by at most which stands


@dataclass(frozen=True, eq=False)
class Order:
    """One throw or kick.

    body: the armature's name. act: "throw" or "kick". skeleton: the armature's; of a control rig, that of the bones
    that `table` (part -> bone) names, and lift: m that its soles are thicker than that skeleton's. own: what it plays,
    in the scene's metres, None where it only stands; first: the scene frame with which that begins. place (2,) m and
    facing rad: where an armature without a motion stands. targets (F, 3) m: where the target is on each frame from the
    release on, (1, 3) of one that stands. at: s of the release; begins: s of the scene's first frame; waits: whether
    the release may come later so that the throw does not begin before that. speed: m/s, 0 as usual. ball_place: (3,) m
    where a ball that is kicked lies, None where it suits. model: a file, "" for what comes with the extension. folder:
    the library's, "" for none; build: how it is built. digest: of the settings."""

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
    targets: np.ndarray
    at: float
    begins: float
    waits: bool
    speed: float
    kind: str
    ball_place: np.ndarray | None
    model: str
    seed: int
    folder: str
    unit: float | None
    library: "Library | None"
    build: dict = field(default_factory=dict)
    digest: str = ""


def digest(scene: bpy.types.Scene, body: bpy.types.Object, act: str) -> str:
    """What an armature's settings ask for, to be compared. A target that moves by itself is told by its name alone."""
    wish, common = body.beyond_mocap_throw, scene.beyond_mocap
    folder = common.library_folder if wish.library else ""
    model = wish.throw_model if act == "throw" else wish.kick_model
    ball = wish.ball.name if wish.ball is not None else ""
    plain = (act, wish.side, wish.frame, round(wish.speed, 3), ball, wish.kind, folder, model, wish.seed)
    return json.dumps([*plain, target_key(scene, wish)])


def order_of(scene: bpy.types.Scene, body: bpy.types.Object, act: str, frame: int = 0) -> Order:
    """What an armature's settings ask for, on `frame`, 0 as they say; InputError where it cannot be animated so."""
    wish, common = body.beyond_mocap_throw, scene.beyond_mocap
    check(scene, body)
    fps, rig = frames_per_second(scene), rigged.rig_of(scene, body)
    skeleton = armature.skeleton_of(body, scene) if rig is None else rig.skeleton
    own, first = _own(scene, body) if rig is None else rigged.own(scene, body)
    place, facing = _stands(scene, body, skeleton) if rig is None else rigged.stands(rig)
    limb, frame = f"{wish.side}_{LIMBS[act]}", frame or wish.frame
    waits = not frame and (act == "throw" or wish.ball is None or first_motion(wish.ball, wish) is None)
    frame = frame or scene.frame_current
    model = wish.throw_model if act == "throw" else wish.kick_model
    folder = absolute(common.library_folder) if wish.library and common.library_folder else ""
    unit = common.library_unit or None
    return Order(body=body.name, act=act, limb=limb, skeleton=skeleton, table=rig.table if rig is not None else {},
                 lift=rigged.lift(rig) if rig is not None and act == "throw" else 0.0, fps=fps, own=own, first=first,
                 place=place, facing=facing, targets=target_places(scene, wish, frame), at=frame / fps,
                 begins=scene.frame_start / fps, waits=waits, speed=wish.speed,
                 kind=USUAL[act] if wish.kind == "usual" else wish.kind,
                 ball_place=place_at(scene, wish.ball, wish, frame) if act == "kick" and wish.ball else None,
                 model=absolute(model) if model else "", seed=wish.seed, folder=folder, unit=unit,
                 library=session.library(folder, unit) if folder else None,
                 build=preferences.for_build(folder) if folder else {}, digest=digest(scene, body, act))


def check(scene: bpy.types.Scene, body: bpy.types.Object) -> None:
    """InputError where an armature or its ball cannot be animated here."""
    wish = body.beyond_mocap_throw
    channels.check_local(body, wish.ball)
    channels.check_free(body)
    refuse_system_override(body)
    if body.beyond_mocap_ride.on:
        raise InputError(f"armature {body.name}", "its motion rides a path", "an armature that does not",
                         "press Keep or Leave first")
    if body.mode == "EDIT":
        raise InputError(f"armature {body.name}", "its bones are being edited", "object or pose mode",
                         "leave edit mode (Tab)")
    ball = wish.ball
    if ball is None:
        return
    if ball.name not in scene.objects:
        raise InputError("ball", f"{ball.name} is not in this scene", "a ball of this scene", "pick another")
    channels.check_free(ball)
    possession.check_unaimed(ball)
    other = flies_for(ball, body)
    if other is not None:
        raise InputError(f"ball {ball.name}", f"it flies for {other.name}", "a ball that no throw shows yet",
                         f"press Keep or Leave at {other.name} first, or choose another ball")  # fmt: skip
    holds = {hold.name for hold in ball.beyond_mocap_ball.holds}
    if ball.parent is not None or any(one.name not in holds for one in ball.constraints):
        found = "it has a parent or a constraint"
        raise InputError(f"ball {ball.name}", found, "a ball of its own", "clear them, or choose another ball")


def place_at(scene: bpy.types.Scene, ball: bpy.types.Object, wish: BeyondMocapThrow, frame: int) -> np.ndarray:
    """(3,) m where a ball is on a frame without this throw; InputError where it is carried then."""
    for hold in _other_holds(ball, wish):
        if hold.first <= frame < hold.last:
            raise InputError(f"ball {ball.name}", f"{possession.holder_name(hold)} carries it on frame {frame}",
                             "a ball that lies", "choose another frame, or free the ball")

    place = way_before(ball, wish, np.array([frame]))[0].to_translation()
    return np.array(place) / units_per_metre(scene)


def first_motion(ball: bpy.types.Object, wish: BeyondMocapThrow) -> int | None:
    """The first frame on which a ball does something without this throw; None for one that lies all the time."""
    ends = channels.keyed_range(_own_way(ball, wish)[0])
    firsts = [hold.first - 1 for hold in _other_holds(ball, wish)] + ([ends[0]] if ends is not None else [])
    return min(firsts) if firsts else None


def way_before(ball: bpy.types.Object, wish: BeyondMocapThrow, frames: np.ndarray) -> list[Matrix]:
    """Where a ball is on frames (F,) without this throw, units; as if nobody carried it while somebody does."""
    curves, stance = _own_way(ball, wish)
    found, ends = possession.way_of(curves, stance, frames), channels.keyed_range(curves)
    for hold in sorted(_other_holds(ball, wish), key=lambda hold: hold.last):
        if ends is None or ends[1] <= hold.last:  # it stays where it was let go
            action, slot = channels.playing(ball)
            shown = channels.curves(action, slot) if action is not None else {}
            dropped = possession.way_of(shown, stance_of(ball)[""], np.array([hold.last]))[0]
            found = [dropped if frame >= hold.last else place for frame, place in zip(frames, found)]
    return found


def taken_from(ball: bpy.types.Object, wish: BeyondMocapThrow, first: int, last: int) -> int:
    """The frame, of first .. last, from which on the hand has a ball that it lets go on `last`: when others have done
    with it. InputError where they have not."""
    for hold in sorted(_other_holds(ball, wish), key=lambda hold: hold.last):
        if hold.first < last and first < hold.last:
            first = hold.last
            if first >= last - 1:
                found = f"{possession.holder_name(hold)} carries it on frames {hold.first} to {hold.last}"
                raise InputError(f"ball {ball.name}", found, "a ball that nobody else carries by then",
                                 "choose a later frame, or free the ball")
    return first


def flies_for(ball: bpy.types.Object, body: bpy.types.Object) -> bpy.types.Object | None:
    """Another armature whose throw, not kept yet, this ball shows; one that was deleted counts no more, though its ball
    keeps it in the file."""
    return next(
        (one for one in bpy.data.objects if one.type == "ARMATURE" and one != body and one.beyond_mocap_throw.made
         and one.beyond_mocap_throw.flown == ball and one.users_scene), None,
    )  # fmt: skip


def _own(scene: bpy.types.Scene, body: bpy.types.Object) -> tuple["Motion | None", int]:
    """What an armature plays without its throw, None where nothing, and the scene frame of its first pose."""
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
    check_finite(body, motion)
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


def target_places(scene: bpy.types.Scene, wish: BeyondMocapThrow, frame: int) -> np.ndarray:
    """(F, 3) m: the target on each frame from `frame` on, (1, 3) if it stands. InputError below ground or elsewhere."""
    target, metres = wish.target, 1.0 / units_per_metre(scene)
    if target is None:
        found = np.array([scene.cursor.location]) * metres
    elif target.name not in scene.objects:
        raise InputError("target", f"{target.name} is not in this scene", "an object of this scene", "pick another")
    elif _may_move(target):
        found = _target_way(scene, target, frame) * metres
        if np.ptp(found, axis=0).max() < _STILL:
            found = found[:1]
    else:
        found = np.array([_resting(target).translation]) * metres
    below = found[:, 2].min()
    if below < 0.0:
        raise InputError("target", f"{-below:.2f} m below the ground", "one on or above it, where balls get",
                         "raise it")
    return found


def target_key(scene: bpy.types.Scene, wish: BeyondMocapThrow) -> list | str:
    """Where the target is, units, or the name of one that may move by itself."""
    target = wish.target
    if target is not None and _may_move(target):
        return target.name
    place = scene.cursor.location if target is None else _resting(target).translation
    return [round(value, 5) for value in place]


def _may_move(thing: bpy.types.Object) -> bool:
    """Whether keys, drivers or constraints have a say in where an object is, or in where its parents are."""
    while thing is not None:
        if thing.animation_data is not None or len(thing.constraints) or thing.type == "ARMATURE" or thing.rigid_body:
            return True
        thing = thing.parent
    return False


def _resting(thing: bpy.types.Object) -> Matrix:
    """Where an object is that nothing moves. Worked out, since Blender forgets the matrix_world of what is hidden with
    the next undo or load."""
    parent = thing.parent
    if parent is None:
        return thing.matrix_basis
    if thing.parent_type != "OBJECT" or parent.type == "CURVE":
        return thing.matrix_world
    return _resting(parent) @ thing.matrix_parent_inverse @ thing.matrix_basis


def _target_way(scene: bpy.types.Scene, target: bpy.types.Object, frame: int) -> np.ndarray:
    """(F, 3) units: where a target is from a frame on."""
    found = []
    with alone(target, scene) as side:
        for at in range(frame, frame + int(TARGET_SECONDS * frames_per_second(scene)) + 1):
            side.frame_set(at)
            found.append(target.evaluated_get(side.view_layers[0].depsgraph).matrix_world.translation[:])
    return np.array(found)


def _own_way(ball: bpy.types.Object, wish: BeyondMocapThrow) -> tuple[dict, list]:
    """The curves of a ball's own way without this throw, and how it stands."""
    own = ball.beyond_mocap_ball.before
    if wish.flown == ball and wish.ball_before.kept:
        return possession.played_before(wish.ball_before)
    if own.kept:
        return possession.played_before(own)
    action, slot = channels.playing(ball)
    return channels.curves(action, slot) if action is not None else {}, stance_of(ball)[""]


def _other_holds(ball: bpy.types.Object, wish: BeyondMocapThrow) -> list:
    """The stretches in which the ball is carried, without this throw's."""
    return [hold for hold in ball.beyond_mocap_ball.holds if not (wish.flown == ball and hold.name == wish.hold)]
