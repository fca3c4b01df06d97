"""Possession: a bone carries the ball for some frames, by a Child Of constraint whose influence is keyed.

The ball's own action is set aside; it plays one that is built from it and from all stretches in which it is carried, so
that each of them can be changed or removed. Where a stretch begins, the ball is where it was. Where it ends, the ball
is on its own path again if that continues, otherwise it stays where it was released. Between, it is rigid with the
bone, except for the frames at either end in which it moves to its carried position and back.

With T the bone's matrix in the world, W the ball's own path and L = T^-1 W the ball in the bone's frame, the constraint
shows T inv own. Its inverse is that of T on the first frame, so own = T(first) L there, which is W: no jump.
"""

from __future__ import annotations

import json

import bpy
import numpy as np
from mathutils import Matrix, Quaternion, Vector

from ...beyond_mocap.base.easing import smoothstep
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.fixes import Fix
from ...beyond_mocap.motion.humanoid import identify_joints
from ..core import channels
from ..core.measure import frames_per_second, units_per_metre
from ..core.saved_state import restore_playback, save_playback
from ..path_editing.rig_sampling import create_private_scene, find_rotation_channel, to_rotations
from ..result.result import BeyondMocapBefore
from ..rigs import armature
from .settings import KEPT, BeyondMocapHold

CONSTANT = 0  # value of Keyframe.interpolation for foreach_set
FASTEST = 8.0  # m/s with which a ball moves to its carried position; over a long distance it takes longer than set
JUST_BEFORE = 0.02  # frames; Blender merges keys within 0.01
SKIN_DISTANCES = {"hand": 0.03, "foot": 0.045, "head": 0.1, "chest": 0.12}  # m from a bone to the skin over it


def find_bone(scene: bpy.types.Scene, body: bpy.types.Object, part: str, side: str) -> str:
    """Find the bone of a part.

    Raises:
        InputError: if the skeleton lacks it.
    """
    skeleton = armature.build_skeleton(body, scene)
    humanoid = identify_joints(skeleton)
    limb = getattr(humanoid, side)
    joint = {
        "foot": limb.toe_or_foot, "hand": limb.hand, "tool": limb.hand, "head": humanoid.head, "chest": humanoid.chest,
    }[part]  # fmt: skip
    if joint is None:
        raise InputError(f"armature {body.name}", f"no bone for the {part}", "a humanoid skeleton",
                         "choose another part, or enter the bone's name")
    return skeleton.names[joint]


def add_hold(
    scene: bpy.types.Scene, ball: bpy.types.Object, body: bpy.types.Object, bone: str, first: int, last: int,
    mode: str = "KEEP", settle: int = 4, skin: float = 0.03,
) -> BeyondMocapHold:
    """Attach the ball to a bone.

    Args:
        scene: the scene.
        ball: the ball.
        body: the armature.
        bone: the bone that carries the ball.
        first: first frame on which it is carried.
        last: frame on which it is released.
        mode: one of `setting.HOLDS`.
        settle: frames in which it moves to its carried position.
        skin: m from the bone to the surface that touches the ball.
    Returns:
        The new stretch.
    Raises:
        InputError: if the ball cannot be carried; nothing is changed then.
    """
    _check_hold(ball, body, bone, first, last)
    for other in ball.beyond_mocap_ball.holds:
        if first < other.last and other.first < last:
            raise InputError(f"ball {ball.name}",
                             f"already carried by {describe_holder(other)} on frames {other.first} to {other.last}",
                             "other frames", "free the ball there first")
    if not ball.beyond_mocap_ball.before.kept:
        save_playback(ball.beyond_mocap_ball.before, ball)
    hold = ball.beyond_mocap_ball.holds.add()
    hold.body, hold.bone, hold.first, hold.last = body, bone, first, last
    hold.how, hold.settle, hold.skin = mode, settle, skin
    constraint = ball.constraints.new("CHILD_OF")
    constraint.name = f"Carried by {body.name}"
    constraint.target, constraint.subtarget = body, bone
    constraint.use_scale_x = constraint.use_scale_y = constraint.use_scale_z = False
    constraint.influence = 0.0
    hold.name = constraint.name
    rebuild_action(scene, ball)
    return hold


def remove_holds(scene: bpy.types.Scene, ball: bpy.types.Object, number: int | None = None) -> None:
    """Remove one stretch in which the ball is carried, or all; after the last one it plays its own action again."""
    channels.check_local(ball)
    channels.check_editable(ball)
    check_unaimed(ball)
    own = ball.beyond_mocap_ball
    for index in reversed(range(len(own.holds)) if number is None else [number]):
        constraint = ball.constraints.get(own.holds[index].name)
        if constraint is not None:
            ball.constraints.remove(constraint)
        own.holds.remove(index)
    if any(_is_valid_hold(ball, hold) for hold in own.holds):
        rebuild_action(scene, ball)
    elif own.before.kept:
        restore_playback(own.before, ball, KEPT)


def rebuild_action(scene: bpy.types.Scene, ball: bpy.types.Object) -> None:
    """Build the ball's action from its own path and all stretches in which it is carried.

    Stretches whose armature, bone or constraint no longer exists are ignored; at least one is left.
    """
    holds = sorted((hold for hold in ball.beyond_mocap_ball.holds if _is_valid_hold(ball, hold)),
                   key=lambda hold: hold.first)
    frames, own_places, ends = sample_own_path(scene, ball, holds)
    own, releases = list(own_places), []
    for hold in holds:
        a, b = hold.first - frames[0], hold.last - frames[0]
        bones = _sample_bone(scene, hold)
        carried = _compute_carried(scene, hold, bones, start=own[a],
                                   end=own[b] if ends is not None and ends[1] > hold.last else None, ball=ball)
        # the constraint's inverse is that of the bone on the first frame, so there is no jump there
        inverse = bones[0]
        ball.constraints[hold.name].inverse_matrix = inverse.inverted()
        releases.append((hold, inverse @ carried[-1]))
        # no path of its own after this stretch
        if ends is None or ends[1] <= hold.last:  # it stays where it was released
            own[b:] = [bones[-1] @ carried[-1]] * (len(own) - b)
        own[a:b] = [inverse @ place for place in carried[:-1]]
    _write_action(ball, frames, own, releases)


def replace_own_action(scene: bpy.types.Scene, ball: bpy.types.Object, write) -> None:
    """Replace the ball's own action by calling `write()`; stretches in which it is carried apply to its new path."""
    own, name = ball.beyond_mocap_ball, ball.name
    carried = any(_is_valid_hold(ball, hold) for hold in own.holds)
    if own.before.kept:
        restore_playback(own.before, ball, KEPT)
    write()
    if carried and bpy.data.objects.get(name) == ball and not own.before.kept:  # `write` may have called this
        save_playback(own.before, ball)
        rebuild_action(scene, ball)


def sample_own_path(
    scene: bpy.types.Scene, ball: bpy.types.Object, holds
) -> tuple[np.ndarray, list[Matrix], tuple[int, int] | None]:
    """Sample the ball's own path.

    Returns:
        frames: (F,) frames.
        places: the ball's matrix on each of them.
        ends: first and last frame with a key of its own action, or None.
    """
    curves, stance = find_own_curves(ball.beyond_mocap_ball.before)
    ends = channels.find_key_range(curves)
    first, last = min(hold.first for hold in holds) - 1, max(hold.last for hold in holds) + 1
    if ends is not None:
        first, last = min(first, ends[0]), max(last, ends[1])
    frames = np.arange(first, last + 1)
    return frames, sample_places(curves, stance, frames), ends


def find_own_curves(before: BeyondMocapBefore) -> tuple[dict, list]:
    """Find the curves of the ball's own action, and its rest transform as `saved_state.read_stance` stores it."""
    return read_curves_before(before), json.loads(before.stance)[""]


def read_curves_before(before: BeyondMocapBefore) -> dict:
    """Find the curves that an object played before, by data path and index."""
    slots = before.action.slots if before.action is not None else ()
    slot = next((one for one in slots if one.identifier == before.slot), None)
    return channels.collect_curves(before.action, slot) if slot is not None else {}


def sample_places(curves: dict, stance: list, frames: np.ndarray) -> list[Matrix]:
    """Sample the ball's matrix on frames (F,), units, from its curves and its transform without them."""
    mode, paths = stance[0], ("location", "rotation_quaternion", "rotation_euler", "rotation_axis_angle")
    still = dict(zip(paths, stance[1:]))
    places, rotations = (sample_property(curves, path, frames, still[path])
                         for path in ("location", find_rotation_channel(mode)))
    return [Matrix.LocRotScale(place, Quaternion(to_rotations(mode, turn[None])[0]), None)
            for place, turn in zip(places, rotations)]


def sample_property(curves: dict, path: str, frames: np.ndarray, still) -> np.ndarray:
    """Sample values (F, n) of a property on frames (F,); where it has no curve as in `still` (n,)."""
    columns = [channels.sample_curve(curves[path, i], frames) if (path, i) in curves else np.full(len(frames), value)
               for i, value in enumerate(still)]
    return np.stack(columns, axis=1)


def check_unaimed(ball: bpy.types.Object) -> None:
    """Check that a ball is neither aimed nor moved by rigid bodies: a hold would be invisible, or the aim lost.

    Raises:
        InputError: if it is.
    """
    aim = ball.beyond_mocap_aim
    if aim.handed:
        raise InputError(f"ball {ball.name}", "moved by Blender's physics", "a ball with keys",
                         "press Ball from Physics first", fixes=(Fix("press", "beyond_mocap.ball_from_physics"),))
    if aim.on:
        raise InputError(f"ball {ball.name}", "it is aimed", "a ball that is not aimed", "press Revert Aim first",
                         fixes=(Fix("press", "beyond_mocap.leave_aim"),))


def _check_hold(ball, body, bone: str, first: int, last: int) -> None:
    """Check that a bone can carry the ball on these frames."""
    channels.check_local(ball)
    channels.check_editable(ball)
    check_unaimed(ball)
    if bone not in body.data.bones:
        raise InputError(f"armature {body.name}", f"no bone {bone!r}", "one of its bones",
                         "find their names in Pose Mode")
    if last <= first:
        raise InputError("possession", f"from frame {first} to {last}", "a last frame after the first one",
                         "set From and To")
    if ball.parent is not None:
        raise InputError(f"ball {ball.name}", f"a child of {ball.parent.name}", "an object without a parent",
                         "clear its parent with Alt-P, Clear and Keep Transformation")
    playing = ball.animation_data
    tracks = playing.nla_tracks if playing is not None and playing.use_nla else ()
    if any(not track.mute and len(track.strips) for track in tracks):
        raise InputError(f"ball {ball.name}", "it plays NLA strips", "an action of its own",
                         "bake them in the NLA editor: Edit, Bake Action")
    if ball == body or ball.type == "ARMATURE":
        raise InputError(f"object {ball.name}", "an armature", "a ball", "select the ball and the armature")


def _is_valid_hold(ball, hold) -> bool:
    """Whether a stretch still has its armature, bone and constraint."""
    return hold.body is not None and hold.bone in hold.body.pose.bones and hold.name in ball.constraints


def _sample_bone(scene, hold) -> list[Matrix]:
    """Sample the bone's matrices in the world on the frames of a stretch, without scale."""
    found = []
    with create_private_scene(hold.body, scene) as side:
        for frame in range(hold.first, hold.last + 1):
            side.frame_set(frame)
            shown = hold.body.evaluated_get(side.view_layers[0].depsgraph)
            place, turn, _ = (shown.matrix_world @ shown.pose.bones[hold.bone].matrix).decompose()
            found.append(Matrix.LocRotScale(place, turn, None))
    return found


def _compute_carried(scene, hold, bones: list[Matrix], start: Matrix, end: Matrix | None, ball) -> list[Matrix]:
    """Compute the ball's matrix in the bone's frame on each frame of a stretch.

    It moves from `start` to its carried position, and to `end`, both in the world; `end` None: it ends where it is
    carried.
    """
    begins = bones[0].inverted() @ start
    held = begins if hold.how == "KEEP" else _place_touching(scene, hold, begins, ball)
    ends = held if end is None else bones[-1].inverted() @ end
    count = len(bones) - 1
    distance = max((held.to_translation() - place.to_translation()).length for place in (begins, ends))
    # frames that the ball needs at FASTEST for the longer one of both movements
    least = distance / units_per_metre(scene) / FASTEST * frames_per_second(scene)
    settle, found = 0, []
    if hold.how != "KEEP" or end is not None:
        settle = max(1, min(max(hold.settle, int(np.ceil(least))), count // 2))
    for row in range(count + 1):
        place = held
        if hold.how != "KEEP" and row < settle:
            place = _blend_matrices(begins, held, row / settle)
        if end is not None and row > count - settle:
            place = _blend_matrices(held, ends, (row - count + settle) / settle)
        found.append(place)
    return found


def _place_touching(scene, hold, begins: Matrix, ball) -> Matrix:
    """Compute the matrix at which the ball touches the bone, on the side on which it is."""
    units = units_per_metre(scene)
    length = hold.body.pose.bones[hold.bone].length * float(np.mean(hold.body.matrix_world.to_scale()))
    centre = begins.to_translation()
    nearest = Vector((0.0, min(max(centre.y, 0.0), length), 0.0))
    away = centre - nearest
    away = away.normalized() if away.length > 1e-6 else Vector((0.0, 0.0, 1.0))
    reach = 0.5 * max(ball.dimensions) + hold.skin * units
    return Matrix.LocRotScale(nearest + reach * away, begins.to_quaternion(), None)


def _blend_matrices(one: Matrix, other: Matrix, share: float) -> Matrix:
    """Blend smoothly from one matrix to another."""
    smooth = float(smoothstep(share))
    place = one.to_translation().lerp(other.to_translation(), smooth)
    return Matrix.LocRotScale(place, one.to_quaternion().slerp(other.to_quaternion(), smooth), None)


def _write_action(ball, frames: np.ndarray, own: list[Matrix], releases: list) -> None:
    """Write keys on every frame, and one more just before each release.

    Nothing moves between these two: before a release places are in the constraint's frame, afterwards in the world.
    """
    rows = [(float(frame), place) for frame, place in zip(frames, own)]
    rows += [(hold.last - JUST_BEFORE, place) for hold, place in releases]
    rows.sort(key=lambda row: row[0])
    at = np.array([frame for frame, _ in rows])
    mode = ball.rotation_mode
    path = find_rotation_channel(mode)
    curves = {"location": ("Object Transforms", np.array([place.to_translation() for _, place in rows])),
              path: ("Object Transforms", _to_channel_values(mode, [place.to_quaternion() for _, place in rows]))}
    for hold, _ in releases:
        # influence 1 from the first frame to just before the release
        held = (at >= hold.first) & (at < hold.last)
        influence = f'constraints["{bpy.utils.escape_identifier(hold.name)}"].influence'
        curves[influence] = ("Possession", held[:, None].astype(float))
    channels.remove_marked_action(ball, KEPT)
    written = channels.create_action(ball, f"{ball.name} carried", at, curves)
    written[KEPT] = True
    ends = np.isin(at, [hold.last - JUST_BEFORE for hold, _ in releases])
    for (name, _), curve in channels.collect_curves(written, ball.animation_data.action_slot).items():
        # keys of the influence, and those just before a release, hold their value until the next key
        still = np.ones(len(at), bool) if name.endswith("influence") else ends
        curve.keyframe_points.foreach_set("interpolation", np.where(still, CONSTANT, channels.LINEAR).astype(np.int32))
        curve.update()


def _to_channel_values(mode: str, quaternions: list[Quaternion]) -> np.ndarray:
    """Convert rotations to values (F, n) of a rotation mode's channel, each continuous with the one before."""
    found, before = [], None
    for turn in quaternions:
        if mode == "QUATERNION":
            turn = turn.copy()
            if before is not None:
                turn.make_compatible(before)
            found.append(tuple(turn))
            before = turn
        elif mode == "AXIS_ANGLE":
            axis, angle = turn.to_axis_angle()
            found.append((angle, *axis))
        else:
            before = turn.to_euler(mode, before) if before is not None else turn.to_euler(mode)
            found.append(tuple(before))
    return np.array(found)


def describe_holder(hold) -> str:
    """Name of the armature that carries the ball."""
    return hold.body.name if hold.body is not None else "a missing armature"
