"""The ball of a throw or kick: held or at rest, then its flight; and its trajectory as a curve.

Up to the last frame before the release a thrown ball is carried by the hand's bone (`passes.possession`), so that it
stays in the hand when the pose is edited. Its earlier motion continues until then, and `restore_ball` brings it
back.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...beyond_mocap.motion import quaternion
from ..ball.shots import MIN_KEY_DISTANCE, update_trajectory_curve
from ..core import channels
from ..core.measure import units_per_metre
from ..core.saved_state import discard_saved_state, restore_playback, save_playback
from ..passes import possession
from ..passes.characters import remove_object
from ..passes.settings import KEPT
from ..path_editing.curve import remove_curve
from ..result import bake
from ..stage import ball as balls
from .settings import MARK, BeyondMocapThrow
from .throw_task import compute_transforms_before, find_first_free, find_first_motion, find_other_thrower

if TYPE_CHECKING:
    from .generation import ThrowPreview

MAX_JUMP = 0.3  # metres; larger jumps of the ball to the hand are reported
NAMES = {"throw": "Thrown Ball", "kick": "Kicked Ball"}


def show_ball(scene: bpy.types.Scene, body: bpy.types.Object, result: "ThrowPreview") -> list[str]:
    """Show the ball's motion; a ball is created if there is none.

    Its earlier motion continues until the hand holds it or the foot strikes it.

    Args:
        scene: the scene.
        body: the armature.
        result: the throw.
    Returns:
        Messages for people.
    """
    settings = body.beyond_mocap_throw
    if settings.flown is not None and (
        find_other_thrower(settings.flown, body)
        or settings.flown != settings.ball
        and not (settings.ball is None and _is_created(settings) and settings.flown.name in scene.objects)
    ):
        restore_ball(scene, body)
    kind = result.thrown.ball
    ball = settings.ball or settings.flown
    if ball is None:
        remove_unused_actions()
        collection = bake.find_or_create_collection(scene)  # not the sport's ball: it is the one that is thrown
        ball = balls.create_ball(bpy.context, NAMES[result.order.action], collection, balls.RADIUS)
        ball[KEPT], settings.flown = True, ball
        discard_saved_state(settings.ball_before, MARK)
    is_created = ball == settings.flown and _is_created(settings)
    frames, places, turns, hand_frames, messages = build_keys(scene, settings, result, None if is_created else ball)
    curves = {"location": places * units_per_metre(scene), "rotation_quaternion": turns}
    _release_ball(scene, ball, settings)

    def write_motion() -> None:
        if is_created:
            ball.scale = 3 * (kind.radius / balls.RADIUS,)
        elif not settings.ball_before.kept:
            save_playback(settings.ball_before, ball)
        settings.flown = ball
        channels.remove_marked_action(ball, MARK)
        ball.rotation_mode = "QUATERNION"
        named = {path: ("Object Transforms", values) for path, values in curves.items()}
        channels.create_action(ball, f"{ball.name} path", frames, named)[MARK] = True

    possession.replace_own_action(scene, ball, write_motion)
    if hand_frames is not None:
        side = result.order.limb.partition("_")[0]
        bone = result.order.table.get(f"{side} hand") or result.order.skeleton.names[_find_hand(result)]
        settings.hold = possession.add_hold(scene, ball, body, bone, *hand_frames, mode="KEEP").name
        channels.find_playing_action(ball)[0][MARK] = True
    settings.curve = update_trajectory_curve(scene, settings.curve, ball, result.flight)
    return messages


def check_ball(settings: BeyondMocapThrow, result: "ThrowPreview") -> None:
    """Raise InputError if others carry the ball when the hand has to hold it."""
    if settings.ball is not None and result.order.action == "throw":
        find_first_free(settings.ball, settings, *_find_spans(result))


def restore_ball(scene: bpy.types.Scene, body: bpy.types.Object) -> None:
    """Restore the ball's earlier motion; remove a created ball and the trajectory.

    Data that a duplicated armature shares with its original stays with the original.
    """
    settings = body.beyond_mocap_throw
    ball, path = settings.flown, settings.curve
    if ball is None or not find_other_thrower(ball, body):
        if path is not None and path.type == "CURVE":  # after an undo, Blender 4.5 may have another object here
            remove_curve(path)
        if ball is not None:
            _restore_or_remove(scene, ball, settings)
    discard_saved_state(settings.ball_before, MARK)
    for name in ("flown", "curve", "hold"):
        settings.property_unset(name)
    remove_unused_actions()


def apply_ball(body: bpy.types.Object) -> None:
    """Make the ball with its motion a normal object of the user."""
    settings = body.beyond_mocap_throw
    ball = settings.flown
    if ball is not None and not find_other_thrower(ball, body):
        for action in (channels.find_playing_action(ball)[0], ball.beyond_mocap_ball.before.action):
            if action is not None:
                action.pop(MARK, None)
        ball.pop(KEPT, None)
    discard_saved_state(settings.ball_before, MARK)
    for name in ("flown", "curve", "hold"):
        settings.property_unset(name)


def remove_unused_actions() -> None:
    """Remove actions of deleted balls of throws."""
    for action in [one for one in bpy.data.actions if one.get(MARK) and not one.users - one.use_fake_user]:
        bpy.data.actions.remove(action)


def _restore_or_remove(scene: bpy.types.Scene, ball: bpy.types.Object, settings: BeyondMocapThrow) -> None:
    """Restore an existing ball, or remove a created one."""
    is_created = _is_created(settings)
    _release_ball(scene, ball, settings)
    if is_created:
        channels.remove_marked_action(ball, MARK)
        remove_object(ball)
    elif settings.ball_before.kept:
        possession.replace_own_action(scene, ball, lambda: restore_playback(settings.ball_before, ball, MARK))


def _is_created(settings: BeyondMocapThrow) -> bool:
    """Return whether the ball was created for this throw; an existing ball is set aside instead."""
    return bool(settings.flown.get(KEPT)) and not settings.ball_before.kept


def _release_ball(scene: bpy.types.Scene, ball: bpy.types.Object, settings: BeyondMocapThrow) -> None:
    """Release the ball from the hand of this throw."""
    holds = ball.beyond_mocap_ball.holds
    number = next((number for number, hold in enumerate(holds) if hold.name == settings.hold), None)
    if number is not None:
        possession.remove_holds(scene, ball, number)
    settings.property_unset("hold")


def _find_spans(result: "ThrowPreview") -> tuple[int, int]:
    """Return the scene frame on which the throw begins, and the last one before the release."""
    fps, joined = result.order.fps, result.joined
    return int(round(joined.start * fps)) + joined.first, int(np.floor(joined.release * fps + MIN_KEY_DISTANCE))


def build_keys(
    scene: bpy.types.Scene, settings: BeyondMocapThrow, result: "ThrowPreview", ball: bpy.types.Object | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[int, int] | None, list[str]]:
    """Build the keys of the ball.

    Args:
        scene: the scene.
        settings: settings of the throw.
        result: the throw.
        ball: the ball, None for one without an earlier motion.
    Returns:
        Frames (F,), positions (F, 3) m and rotations (F, 4) of the ball; the first and last frame in the hand, None
        for a kick; messages for people.
    """
    fps, flight, joined = result.order.fps, result.flight, result.joined
    release = joined.release * fps
    rest = flight.rests_from if flight.rests_from is not None else flight.end
    whole = np.arange(np.ceil(release + MIN_KEY_DISTANCE), np.ceil(release + rest * fps) + 1)
    exact = np.append(release, release + flight.bounces * fps)
    exact = exact[np.abs(exact - np.round(exact)) > MIN_KEY_DISTANCE]
    frames = np.sort(np.concatenate([whole, exact]))
    frames = frames[np.append(True, np.diff(frames) > MIN_KEY_DISTANCE)]
    seconds = (frames - release) / fps
    flight_keys = frames, flight.at(seconds), flight.rotations(seconds)
    begins, last = _find_spans(result)
    first = int(round(joined.start * fps))
    first_motion = find_first_motion(ball, settings) if ball is not None else None
    if result.order.action == "kick":
        before = np.array([min(first, last - 1) if first_motion is None else last, last], float)
        rest_frames = before[-2 if first_motion is None else -1 :]
        turns = flight_keys[2][:1] if first_motion is None else _compute_earlier(scene, ball, settings, last, last)[2]
        rest_keys = rest_frames, np.repeat(flight.at(np.zeros(1)), len(rest_frames), axis=0), np.repeat(turns,
                len(rest_frames), axis=0)
        if first_motion is not None and first_motion < last:
            rest_keys = _join_arrays(_compute_earlier(scene, ball, settings, first_motion, last - 1), rest_keys)
        return *_append_flight(rest_keys, flight_keys), None, []
    first_held = first if first_motion is None else max(first, begins)
    if ball is not None:
        first_held = find_first_free(ball, settings, first_held, last)
    rows = np.arange(first_held, last + 1)
    hand_keys = rows.astype(float), *compute_in_hand(result, rows - first)
    messages = []
    if first_motion is not None and first_motion < first_held:
        earlier = _compute_earlier(scene, ball, settings, first_motion, first_held - 1)
        distance = float(np.linalg.norm(earlier[1][-1] - hand_keys[1][0]))
        if distance > MAX_JUMP:
            messages = [f"frame {first_held}: the ball jumps to the hand from {distance:.1f} m away; let the hand take "
                        "it before (Take Ball), or choose another ball"]
        hand_keys = _join_arrays(earlier, hand_keys)
    return *_append_flight(hand_keys, flight_keys), (first_held, last), messages


def compute_in_hand(result: "ThrowPreview", rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute positions (N, 3) m and rotations (N, 4) of the held ball at frames (N,) of the whole motion."""
    from ...beyond_mocap.motion.motion import compute_pose

    motion, hand = result.joined.motion, _find_hand(result)
    places, turns = compute_pose(motion.skeleton, motion.root_positions[rows], motion.rotations[rows])
    return places[:, hand] + quaternion.rotate(turns[:, hand], result.thrown.grip), turns[:, hand]


def _find_hand(result: "ThrowPreview") -> int:
    """Find the joint of the hand that throws."""
    from ...beyond_mocap.motion.humanoid import identify_joints

    side = result.order.limb.partition("_")[0]
    return getattr(identify_joints(result.order.skeleton), side).hand


def _compute_earlier(scene, ball, settings, first: int, last: int):
    """Compute frames (F,), positions (F, 3) m and rotations (F, 4) of the ball without this throw."""
    frames = np.arange(first, last + 1)
    transforms = compute_transforms_before(ball, settings, frames)
    places = np.array([place.to_translation() for place in transforms]) / units_per_metre(scene)
    return frames.astype(float), places, np.array([tuple(place.to_quaternion()) for place in transforms])


def _append_flight(before, flight_keys):
    """Join the motion before the release and the flight; the ball's rotation continues from the release."""
    frames, places, turns = flight_keys
    turns = quaternion.multiply(turns, quaternion.multiply(quaternion.inverse(turns[:1]), before[2][-1:]))
    frames, places, turns = _join_arrays(before, (frames, places, turns))
    return frames, places, quaternion.unify_signs(turns)


def _join_arrays(before, behind):
    """Join two tuples of arrays along the first axis."""
    return tuple(np.concatenate(pair) for pair in zip(before, behind))
