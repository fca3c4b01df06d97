"""Read the settings of an armature as a request of plain values, with the motion of target and ball.

It also finds what the ball does before: keyed, thrown before, or carried by others for a while. Seconds are scene
frames divided by the scene's frame rate, so the throw's frames are the scene's.
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

TARGET_SECONDS = 8.0  # seconds from the release for which a target's motion is read
_STILL = 1e-3  # m, largest motion of a target that counts as static


@dataclass(frozen=True, eq=False)
class Order:
    """Request for one throw or kick.

    Attributes:
        body: name of the armature.
        action: "throw" or "kick".
        limb: one of EFFECTORS.
        skeleton: skeleton of the armature; of a control rig, that of the bones that `table` names.
        table: part -> bone of a control rig, empty for others.
        sole_lift: m by which a rig's soles are thicker than those of its skeleton.
        fps: frames per second of the scene.
        own_motion: motion of the armature in the scene's metres, None if it has none.
        first: scene frame at which that motion begins.
        place: (2,) m, position of an armature without motion.
        facing: rad, heading of an armature without motion.
        targets: (F, 3) m, target on each frame from the release, (1, 3) if it is static.
        at: s of the release.
        scene_start: s of the scene's first frame.
        may_wait: the release may be later so that the throw does not begin before the scene.
        speed: m/s, 0 for automatic.
        kind: kind of ball.
        ball_place: (3,) m of a ball that is kicked, None to be chosen.
        model: file of weights, "" for the one included.
        seed: selects another motion.
        folder: folder of the library, "" for none.
        unit: metres per unit of the library, None for automatic.
        library: loaded library, or None.
        build: options of building the library.
        digest: digest of the settings.
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
    """Format an armature's settings as text to compare; a target that moves by itself is identified by its name."""
    wish, common = body.beyond_mocap_throw, scene.beyond_mocap
    folder = common.library_folder if wish.library else ""
    model = wish.throw_model if act == "throw" else wish.kick_model
    ball = wish.ball.name if wish.ball is not None else ""
    plain = (act, wish.side, wish.frame, round(wish.speed, 3), ball, wish.kind, folder, model, wish.seed)
    return json.dumps([*plain, target_key(scene, wish)])


def order_of(scene: bpy.types.Scene, body: bpy.types.Object, act: str, frame: int = 0) -> Order:
    """Build the request of an armature's settings.

    Args:
        scene: the scene.
        body: the armature.
        act: "throw" or "kick".
        frame: frame of the release, 0 for the one of the settings.
    Raises:
        InputError: if the armature or the ball cannot be animated.
    """
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
    """Raise InputError if an armature or its ball cannot be animated."""
    wish = body.beyond_mocap_throw
    channels.check_local(body, wish.ball)
    channels.check_free(body)
    refuse_system_override(body)
    if body.beyond_mocap_ride.on:
        raise InputError(f"armature {body.name}", "it has a path edit in preview", "an armature without a path edit",
                         "press Apply or Revert first")
    if body.mode == "EDIT":
        raise InputError(f"armature {body.name}", "it is in edit mode", "object or pose mode",
                         "leave edit mode (Tab)")
    ball = wish.ball
    if ball is None:
        return
    if ball.name not in scene.objects:
        raise InputError("ball", f"{ball.name} is not in this scene", "a ball of this scene", "choose another ball")
    channels.check_free(ball)
    possession.check_unaimed(ball)
    other = flies_for(ball, body)
    if other is not None:
        raise InputError(f"ball {ball.name}", f"it is in the preview of {other.name}", "a ball without a preview",
                         f"press Apply or Revert for {other.name} first, or choose another ball")  # fmt: skip
    holds = {hold.name for hold in ball.beyond_mocap_ball.holds}
    if ball.parent is not None or any(one.name not in holds for one in ball.constraints):
        found = "it has a parent or a constraint"
        raise InputError(f"ball {ball.name}", found, "a ball without them", "clear them, or choose another ball")


def place_at(scene: bpy.types.Scene, ball: bpy.types.Object, wish: BeyondMocapThrow, frame: int) -> np.ndarray:
    """Find the position (3,) m of a ball on a frame without this throw; InputError if it is carried then."""
    for hold in _other_holds(ball, wish):
        if hold.first <= frame < hold.last:
            raise InputError(f"ball {ball.name}", f"{possession.holder_name(hold)} carries it on frame {frame}",
                             "a ball that is not carried", "choose another frame, or free the ball")

    place = way_before(ball, wish, np.array([frame]))[0].to_translation()
    return np.array(place) / units_per_metre(scene)


def first_motion(ball: bpy.types.Object, wish: BeyondMocapThrow) -> int | None:
    """Find the first frame on which a ball moves without this throw; None if it never moves."""
    ends = channels.keyed_range(_own_way(ball, wish)[0])
    firsts = [hold.first - 1 for hold in _other_holds(ball, wish)] + ([ends[0]] if ends is not None else [])
    return min(firsts) if firsts else None


def way_before(ball: bpy.types.Object, wish: BeyondMocapThrow, frames: np.ndarray) -> list[Matrix]:
    """Compute the transforms of a ball on frames (F,) without this throw, in units.

    Frames on which others carry it are computed as if they did not.
    """
    curves, stance = _own_way(ball, wish)
    found, ends = possession.way_of(curves, stance, frames), channels.keyed_range(curves)
    for hold in sorted(_other_holds(ball, wish), key=lambda hold: hold.last):
        if ends is None or ends[1] <= hold.last:  # it stays where it was released
            action, slot = channels.playing(ball)
            shown = channels.curves(action, slot) if action is not None else {}
            dropped = possession.way_of(shown, stance_of(ball)[""], np.array([hold.last]))[0]
            found = [dropped if frame >= hold.last else place for frame, place in zip(frames, found)]
    return found


def taken_from(ball: bpy.types.Object, wish: BeyondMocapThrow, first: int, last: int) -> int:
    """Find the first frame from which the hand can hold a ball: after the last other that carries it.

    Args:
        ball: the ball.
        settings: settings of the throw.
        first: first frame of the throw.
        last: last frame in the hand.
    Raises:
        InputError: if another carries it until the release.
    """
    for hold in sorted(_other_holds(ball, wish), key=lambda hold: hold.last):
        if hold.first < last and first < hold.last:
            first = hold.last
            if first >= last - 1:
                found = f"{possession.holder_name(hold)} carries it on frames {hold.first} to {hold.last}"
                raise InputError(f"ball {ball.name}", found, "a ball that is free before the release",
                                 "choose a later frame, or free the ball")
    return first


def flies_for(ball: bpy.types.Object, body: bpy.types.Object) -> bpy.types.Object | None:
    """Find another armature whose preview uses this ball.

    Deleted armatures do not count, though the file may still contain them.
    """
    return next(
        (one for one in bpy.data.objects if one.type == "ARMATURE" and one != body and one.beyond_mocap_throw.made
         and one.beyond_mocap_throw.flown == ball and one.users_scene), None,
    )  # fmt: skip


def _own(scene: bpy.types.Scene, body: bpy.types.Object) -> tuple["Motion | None", int]:
    """Read an armature's motion without its throw, None if it has none, and the scene frame of its first pose."""
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
    """Find position (2,) m and heading (rad) of an armature without motion."""
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
    """Read the target's positions (F, 3) m from `frame` on, (1, 3) if it is static; InputError if it is invalid."""
    target, metres = wish.target, 1.0 / units_per_metre(scene)
    if target is None:
        found = np.array([scene.cursor.location]) * metres
    elif target.name not in scene.objects:
        raise InputError("target", f"{target.name} is not in this scene", "an object of this scene",
                         "choose another target")  # fmt: skip
    elif _may_move(target):
        found = _target_way(scene, target, frame) * metres
        if np.ptp(found, axis=0).max() < _STILL:
            found = found[:1]
    else:
        found = np.array([_resting(target).translation]) * metres
    below = found[:, 2].min()
    if below < 0.0:
        raise InputError("target", f"{-below:.2f} m below the ground", "a target on or above the ground",
                         "move it up")
    return found


def target_key(scene: bpy.types.Scene, wish: BeyondMocapThrow) -> list | str:
    """Return the target's position in units, or the name of one that may move by itself."""
    target = wish.target
    if target is not None and _may_move(target):
        return target.name
    place = scene.cursor.location if target is None else _resting(target).translation
    return [round(value, 5) for value in place]


def _may_move(thing: bpy.types.Object) -> bool:
    """Return whether keys, drivers, constraints or physics may move an object or one of its parents."""
    while thing is not None:
        if thing.animation_data is not None or len(thing.constraints) or thing.type == "ARMATURE" or thing.rigid_body:
            return True
        thing = thing.parent
    return False


def _resting(thing: bpy.types.Object) -> Matrix:
    """Compute the transform of an object that nothing moves.

    Undo and loading clear the matrix_world of hidden objects, so it cannot be used.
    """
    parent = thing.parent
    if parent is None:
        return thing.matrix_basis
    if thing.parent_type != "OBJECT" or parent.type == "CURVE":
        return thing.matrix_world
    return _resting(parent) @ thing.matrix_parent_inverse @ thing.matrix_basis


def _target_way(scene: bpy.types.Scene, target: bpy.types.Object, frame: int) -> np.ndarray:
    """Read the positions (F, 3), in units, of a target from a frame on."""
    found = []
    with alone(target, scene) as side:
        for at in range(frame, frame + int(TARGET_SECONDS * frames_per_second(scene)) + 1):
            side.frame_set(at)
            found.append(target.evaluated_get(side.view_layers[0].depsgraph).matrix_world.translation[:])
    return np.array(found)


def _own_way(ball: bpy.types.Object, wish: BeyondMocapThrow) -> tuple[dict, list]:
    """Return the curves of a ball's own motion without this throw, and its transform without curves."""
    own = ball.beyond_mocap_ball.before
    if wish.flown == ball and wish.ball_before.kept:
        return possession.played_before(wish.ball_before)
    if own.kept:
        return possession.played_before(own)
    action, slot = channels.playing(ball)
    return channels.curves(action, slot) if action is not None else {}, stance_of(ball)[""]


def _other_holds(ball: bpy.types.Object, wish: BeyondMocapThrow) -> list:
    """List the ranges in which the ball is carried, without this throw's."""
    return [hold for hold in ball.beyond_mocap_ball.holds if not (wish.flown == ball and hold.name == wish.hold)]
