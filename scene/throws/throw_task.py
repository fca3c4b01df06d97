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
from ...beyond_mocap.throws.network_npz import RECORDED
from ..core import action, channels, preferences, session
from ..core.measure import frames_per_second, units_per_metre
from ..core.saved_state import read_stance
from ..core.settings import to_absolute_path
from ..passes import possession
from ..path_editing.armature_adapter import check_editable_override, check_finite
from ..path_editing.rig_sampling import create_private_scene
from ..rigs import armature
from . import rig_throw as rigged
from .settings import DEFAULT_BALLS, LIMBS, BeyondMocapThrow

if TYPE_CHECKING:
    from ...beyond_mocap.library.library import Library
    from ...beyond_mocap.motion.motion import Motion
    from ...beyond_mocap.motion.skeleton import Skeleton

TARGET_SECONDS = 8.0  # seconds from the release for which a target's motion is read
_MAX_STATIC_MOTION = 1e-3  # m, largest motion of a target that counts as static


@dataclass(frozen=True, eq=False)
class ThrowTask:
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
    action: str
    limb: str
    skeleton: "Skeleton"
    table: dict[str, str]
    sole_lift: float
    fps: float
    own_motion: "Motion | None"
    first: int
    place: np.ndarray
    facing: float
    targets: np.ndarray
    at: float
    scene_start: float
    may_wait: bool
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


def build_digest(scene: bpy.types.Scene, body: bpy.types.Object, act: str) -> str:
    """Format an armature's settings as text to compare; a target that moves by itself is identified by its name."""
    settings, common = body.beyond_mocap_throw, scene.beyond_mocap
    folder = common.library_folder if settings.library else ""
    model = settings.throw_model if act == "throw" else settings.kick_model
    ball = settings.ball.name if settings.ball is not None else ""
    plain = (act, settings.side, settings.frame, round(settings.speed, 3), ball, settings.kind, folder, model,
             settings.seed)
    return json.dumps([*plain, build_target_key(scene, settings)])


def _find_model(model: str) -> str:
    """Return the path of a chosen file of weights; the included ones are chosen by no name or one without a folder."""
    return model if model in ("", RECORDED) else to_absolute_path(model)


def build_request(scene: bpy.types.Scene, body: bpy.types.Object, act: str, frame: int = 0) -> ThrowTask:
    """Build the request of an armature's settings.

    Args:
        scene: the scene.
        body: the armature.
        act: "throw" or "kick".
        frame: frame of the release, 0 for the one of the settings.
    Raises:
        InputError: if the armature or the ball cannot be animated.
    """
    settings, common = body.beyond_mocap_throw, scene.beyond_mocap
    check_throw(scene, body)
    fps, rig = frames_per_second(scene), rigged.find_rig(scene, body)
    skeleton = armature.build_skeleton(body, scene) if rig is None else rig.skeleton
    own, first = _read_own_motion(scene, body) if rig is None else rigged.read_own_motion(scene, body)
    place, facing = _find_stance(scene, body, skeleton) if rig is None else rigged.find_stance(rig)
    limb, frame = f"{settings.side}_{LIMBS[act]}", frame or settings.frame
    waits = not frame and (act == "throw" or settings.ball is None or find_first_motion(settings.ball,
            settings) is None)
    frame = frame or scene.frame_current
    model = settings.throw_model if act == "throw" else settings.kick_model
    folder = to_absolute_path(common.library_folder) if settings.library and common.library_folder else ""
    unit = common.library_unit or None
    return ThrowTask(body=body.name, action=act, limb=limb, skeleton=skeleton, table=rig.table if rig is not None
                     else {}, sole_lift=rigged.measure_sole_lift(rig) if rig is not None and act == "throw" else 0.0,
                     fps=fps, own_motion=own, first=first, place=place, facing=facing,
                     targets=read_target_positions(scene, settings, frame), at=frame / fps,
                     scene_start=scene.frame_start / fps, may_wait=waits, speed=settings.speed, kind=DEFAULT_BALLS[act]
                     if settings.kind == "usual" else settings.kind, ball_place=find_ball_position(scene, settings.ball,
            settings, frame) if act == "kick" and settings.ball else None, model=_find_model(model),
                     seed=settings.seed, folder=folder, unit=unit, library=session.find_library(folder, unit)
                     if folder else None, build=preferences.build_library_options(folder) if folder else {},
                     digest=build_digest(scene, body, act))


def check_throw(scene: bpy.types.Scene, body: bpy.types.Object) -> None:
    """Raise InputError if an armature or its ball cannot be animated."""
    settings = body.beyond_mocap_throw
    channels.check_local(body, settings.ball)
    channels.check_editable(body)
    check_editable_override(body)
    if body.beyond_mocap_ride.on:
        raise InputError(f"armature {body.name}", "it has a path edit in preview", "an armature without a path edit",
                         "press Apply or Revert first")
    if body.mode == "EDIT":
        raise InputError(f"armature {body.name}", "it is in edit mode", "object or pose mode",
                         "leave edit mode (Tab)")
    ball = settings.ball
    if ball is None:
        return
    if ball.name not in scene.objects:
        raise InputError("ball", f"{ball.name} is not in this scene", "a ball of this scene", "choose another ball")
    channels.check_editable(ball)
    possession.check_unaimed(ball)
    other = find_other_thrower(ball, body)
    if other is not None:
        raise InputError(f"ball {ball.name}", f"it is in the preview of {other.name}", "a ball without a preview",
                         f"press Apply or Revert for {other.name} first, or choose another ball")  # fmt: skip
    holds = {hold.name for hold in ball.beyond_mocap_ball.holds}
    if ball.parent is not None or any(one.name not in holds for one in ball.constraints):
        found = "it has a parent or a constraint"
        raise InputError(f"ball {ball.name}", found, "a ball without them", "clear them, or choose another ball")


def find_ball_position(scene: bpy.types.Scene, ball: bpy.types.Object, settings: BeyondMocapThrow,
                       frame: int) -> np.ndarray:
    """Find the position (3,) m of a ball on a frame without this throw; InputError if it is carried then."""
    for hold in _list_other_holds(ball, settings):
        if hold.first <= frame < hold.last:
            raise InputError(f"ball {ball.name}", f"{possession.describe_holder(hold)} carries it on frame {frame}",
                             "a ball that is not carried", "choose another frame, or free the ball")

    place = compute_transforms_before(ball, settings, np.array([frame]))[0].to_translation()
    return np.array(place) / units_per_metre(scene)


def find_first_motion(ball: bpy.types.Object, settings: BeyondMocapThrow) -> int | None:
    """Find the first frame on which a ball moves without this throw; None if it never moves."""
    ends = channels.find_key_range(_read_own_curves(ball, settings)[0])
    firsts = [hold.first - 1 for hold in _list_other_holds(ball, settings)] + ([ends[0]] if ends is not None else [])
    return min(firsts) if firsts else None


def compute_transforms_before(ball: bpy.types.Object, settings: BeyondMocapThrow, frames: np.ndarray) -> list[Matrix]:
    """Compute the transforms of a ball on frames (F,) without this throw, in units.

    Frames on which others carry it are computed as if they did not.
    """
    curves, stance = _read_own_curves(ball, settings)
    found, ends = possession.sample_places(curves, stance, frames), channels.find_key_range(curves)
    for hold in sorted(_list_other_holds(ball, settings), key=lambda hold: hold.last):
        if ends is None or ends[1] <= hold.last:  # it stays where it was released
            action, slot = channels.find_playing_action(ball)
            current_curves = channels.collect_curves(action, slot) if action is not None else {}
            released = possession.sample_places(current_curves, read_stance(ball)[""], np.array([hold.last]))[0]
            found = [released if frame >= hold.last else place for frame, place in zip(frames, found)]
    return found


def find_first_free(ball: bpy.types.Object, settings: BeyondMocapThrow, first: int, last: int) -> int:
    """Find the first frame from which the hand can hold a ball: after the last other that carries it.

    Args:
        ball: the ball.
        settings: settings of the throw.
        first: first frame of the throw.
        last: last frame in the hand.
    Raises:
        InputError: if another carries it until the release.
    """
    for hold in sorted(_list_other_holds(ball, settings), key=lambda hold: hold.last):
        if hold.first < last and first < hold.last:
            first = hold.last
            if first >= last - 1:
                found = f"{possession.describe_holder(hold)} carries it on frames {hold.first} to {hold.last}"
                raise InputError(f"ball {ball.name}", found, "a ball that is free before the release",
                                 "choose a later frame, or free the ball")
    return first


def find_other_thrower(ball: bpy.types.Object, body: bpy.types.Object) -> bpy.types.Object | None:
    """Find another armature whose preview uses this ball.

    Deleted armatures do not count, though the file may still contain them.
    """
    return next(
        (one for one in bpy.data.objects if one.type == "ARMATURE" and one != body and one.beyond_mocap_throw.made
         and one.beyond_mocap_throw.flown == ball and one.users_scene), None,
    )  # fmt: skip


def _read_own_motion(scene: bpy.types.Scene, body: bpy.types.Object) -> tuple["Motion | None", int]:
    """Read an armature's motion without its throw, None if it has none, and the scene frame of its first pose."""
    before = body.beyond_mocap_throw.before
    if before.kept:
        found = before.action
        slot = next((one for one in found.slots if one.identifier == before.slot), None) if found else None
    else:
        found, slot = channels.find_playing_action(body)
    curves = channels.collect_curves(found, slot) if slot is not None else {}
    ends = channels.find_key_range({key: curve for key, curve in curves.items() if key[0].startswith("pose.bones")})
    if ends is None:
        return None, scene.frame_start
    motion = action.read_motion(body, scene, found, slot)
    check_finite(body, motion)
    return motion, ends[0]


def _find_stance(scene: bpy.types.Scene, body: bpy.types.Object, skeleton: "Skeleton") -> tuple[np.ndarray, float]:
    """Find position (2,) m and heading (rad) of an armature without motion."""
    from ...beyond_mocap.motion import quaternion
    from ...beyond_mocap.motion.humanoid import compute_heading_from_positions
    from ...beyond_mocap.motion.motion import compute_pose

    placement = armature.find_placement(body, scene)
    local = quaternion.identity(len(skeleton))
    local[0] = placement.rotation
    places, _ = compute_pose(skeleton, np.zeros(3), local)
    root = placement.to_world(np.array([body.data.bones[skeleton.names[0]].head_local]))[0]
    return np.asarray(root[:2]), float(compute_heading_from_positions(skeleton, places))


def read_target_positions(scene: bpy.types.Scene, settings: BeyondMocapThrow, frame: int) -> np.ndarray:
    """Read the target's positions (F, 3) m from `frame` on, (1, 3) if it is static; InputError if it is invalid."""
    target, metres = settings.target, 1.0 / units_per_metre(scene)
    if target is None:
        found = np.array([scene.cursor.location]) * metres
    elif target.name not in scene.objects:
        raise InputError("target", f"{target.name} is not in this scene", "an object of this scene",
                         "choose another target")  # fmt: skip
    elif _may_move(target):
        found = _read_target_path(scene, target, frame) * metres
        if np.ptp(found, axis=0).max() < _MAX_STATIC_MOTION:
            found = found[:1]
    else:
        found = np.array([_compute_static_transform(target).translation]) * metres
    below = found[:, 2].min()
    if below < 0.0:
        raise InputError("target", f"{-below:.2f} m below the ground", "a target on or above the ground",
                         "move it up")
    return found


def build_target_key(scene: bpy.types.Scene, settings: BeyondMocapThrow) -> list | str:
    """Return the target's position in units, or the name of one that may move by itself."""
    target = settings.target
    if target is not None and _may_move(target):
        return target.name
    place = scene.cursor.location if target is None else _compute_static_transform(target).translation
    return [round(value, 5) for value in place]


def _may_move(thing: bpy.types.Object) -> bool:
    """Return whether keys, drivers, constraints or physics may move an object or one of its parents."""
    while thing is not None:
        if thing.animation_data is not None or len(thing.constraints) or thing.type == "ARMATURE" or thing.rigid_body:
            return True
        thing = thing.parent
    return False


def _compute_static_transform(thing: bpy.types.Object) -> Matrix:
    """Compute the transform of an object that nothing moves.

    Undo and loading clear the matrix_world of hidden objects, so it cannot be used.
    """
    parent = thing.parent
    if parent is None:
        return thing.matrix_basis
    if thing.parent_type != "OBJECT" or parent.type == "CURVE":
        return thing.matrix_world
    return _compute_static_transform(parent) @ thing.matrix_parent_inverse @ thing.matrix_basis


def _read_target_path(scene: bpy.types.Scene, target: bpy.types.Object, frame: int) -> np.ndarray:
    """Read the positions (F, 3), in units, of a target from a frame on."""
    found = []
    with create_private_scene(target, scene) as side:
        for at in range(frame, frame + int(TARGET_SECONDS * frames_per_second(scene)) + 1):
            side.frame_set(at)
            found.append(target.evaluated_get(side.view_layers[0].depsgraph).matrix_world.translation[:])
    return np.array(found)


def _read_own_curves(ball: bpy.types.Object, settings: BeyondMocapThrow) -> tuple[dict, list]:
    """Return the curves of a ball's own motion without this throw, and its transform without curves."""
    own = ball.beyond_mocap_ball.before
    if settings.flown == ball and settings.ball_before.kept:
        return possession.find_own_curves(settings.ball_before)
    if own.kept:
        return possession.find_own_curves(own)
    action, slot = channels.find_playing_action(ball)
    return channels.collect_curves(action, slot) if action is not None else {}, read_stance(ball)[""]


def _list_other_holds(ball: bpy.types.Object, settings: BeyondMocapThrow) -> list:
    """List the ranges in which the ball is carried, without this throw's."""
    return [hold for hold in ball.beyond_mocap_ball.holds
            if not (settings.flown == ball and hold.name == settings.hold)]
