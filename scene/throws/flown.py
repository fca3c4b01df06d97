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
from ..ball.shots import CLOSEST, trajectory
from ..core import channels
from ..core.measure import units_per_metre
from ..core.set_aside import bring_back, drop, put_aside
from ..passes import possession
from ..passes.settings import KEPT
from ..passes.shown import remove
from ..path_editing.curve import remove_curve
from ..result import bake
from ..stage import ball as balls
from .order import first_motion, flies_for, taken_from, way_before
from .settings import MARK, BeyondMocapThrow

if TYPE_CHECKING:
    from .made import Result

FAR = 0.3  # metres; larger jumps of the ball to the hand are reported
NAMES = {"throw": "Thrown Ball", "kick": "Kicked Ball"}


def show(scene: bpy.types.Scene, body: bpy.types.Object, result: "Result") -> list[str]:
    """Show the ball's motion; a ball is created if there is none.

    Its earlier motion continues until the hand holds it or the foot strikes it.

    Args:
        scene: the scene.
        body: the armature.
        result: the throw.
    Returns:
        Messages for people.
    """
    wish = body.beyond_mocap_throw
    if wish.flown is not None and (
        flies_for(wish.flown, body)
        or wish.flown != wish.ball
        and not (wish.ball is None and _is_made(wish) and wish.flown.name in scene.objects)
    ):
        give_back(scene, body)
    kind = result.thrown.ball
    ball = wish.ball or wish.flown
    if ball is None:
        sweep()
        ball = balls.create(bpy.context, NAMES[result.order.act], bake.collection(scene))
        ball[KEPT], wish.flown = True, ball
        drop(wish.ball_before, MARK)
    made = ball == wish.flown and _is_made(wish)
    frames, places, turns, held, told = keys(scene, wish, result, None if made else ball)
    curves = {"location": places * units_per_metre(scene), "rotation_quaternion": turns}
    _let_go(scene, ball, wish)

    def write() -> None:
        if made:
            ball.scale = 3 * (kind.radius / balls.RADIUS,)
        elif not wish.ball_before.kept:
            put_aside(wish.ball_before, ball)
        wish.flown = ball
        channels.discard(ball, MARK)
        ball.rotation_mode = "QUATERNION"
        named = {path: ("Object Transforms", values) for path, values in curves.items()}
        channels.animate(ball, f"{ball.name} path", frames, named)[MARK] = True

    possession.anew(scene, ball, write)
    if held is not None:
        side = result.order.limb.partition("_")[0]
        bone = result.order.table.get(f"{side} hand") or result.order.skeleton.names[_hand(result)]
        wish.hold = possession.take(scene, ball, body, bone, *held, how="KEEP").name
        channels.playing(ball)[0][MARK] = True
    wish.curve = trajectory(scene, wish.curve, ball, result.flight)
    return told


def check(wish: BeyondMocapThrow, result: "Result") -> None:
    """Raise InputError if others carry the ball when the hand has to hold it."""
    if wish.ball is not None and result.order.act == "throw":
        taken_from(wish.ball, wish, *_spans(result))


def give_back(scene: bpy.types.Scene, body: bpy.types.Object) -> None:
    """Restore the ball's earlier motion; remove a created ball and the trajectory.

    Data that a duplicated armature shares with its original stays with the original.
    """
    wish = body.beyond_mocap_throw
    ball, path = wish.flown, wish.curve
    if ball is None or not flies_for(ball, body):
        if path is not None:
            remove_curve(path)
        if ball is not None:
            _brought_back(scene, ball, wish)
    drop(wish.ball_before, MARK)
    for name in ("flown", "curve", "hold"):
        wish.property_unset(name)
    sweep()


def keep(body: bpy.types.Object) -> None:
    """Make the ball with its motion a normal object of the user."""
    wish = body.beyond_mocap_throw
    ball = wish.flown
    if ball is not None and not flies_for(ball, body):
        for action in (channels.playing(ball)[0], ball.beyond_mocap_ball.before.action):
            if action is not None:
                action.pop(MARK, None)
        ball.pop(KEPT, None)
    drop(wish.ball_before, MARK)
    for name in ("flown", "curve", "hold"):
        wish.property_unset(name)


def sweep() -> None:
    """Remove actions of deleted balls of throws."""
    for action in [one for one in bpy.data.actions if one.get(MARK) and not one.users - one.use_fake_user]:
        bpy.data.actions.remove(action)


def _brought_back(scene: bpy.types.Scene, ball: bpy.types.Object, wish: BeyondMocapThrow) -> None:
    """Restore an existing ball, or remove a created one."""
    made = _is_made(wish)
    _let_go(scene, ball, wish)
    if made:
        channels.discard(ball, MARK)
        remove(ball)
    elif wish.ball_before.kept:
        possession.anew(scene, ball, lambda: bring_back(wish.ball_before, ball, MARK))


def _is_made(wish: BeyondMocapThrow) -> bool:
    """Return whether the ball was created for this throw; an existing ball is set aside instead."""
    return bool(wish.flown.get(KEPT)) and not wish.ball_before.kept


def _let_go(scene: bpy.types.Scene, ball: bpy.types.Object, wish: BeyondMocapThrow) -> None:
    """Release the ball from the hand of this throw."""
    holds = ball.beyond_mocap_ball.holds
    number = next((number for number, hold in enumerate(holds) if hold.name == wish.hold), None)
    if number is not None:
        possession.free(scene, ball, number)
    wish.property_unset("hold")


def _spans(result: "Result") -> tuple[int, int]:
    """Return the scene frame on which the throw begins, and the last one before the release."""
    fps, joined = result.order.fps, result.joined
    return int(round(joined.start * fps)) + joined.first, int(np.floor(joined.release * fps + CLOSEST))


def keys(
    scene: bpy.types.Scene, wish: BeyondMocapThrow, result: "Result", ball: bpy.types.Object | None
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
    whole = np.arange(np.ceil(release + CLOSEST), np.ceil(release + rest * fps) + 1)
    exact = np.append(release, release + flight.bounces * fps)
    exact = exact[np.abs(exact - np.round(exact)) > CLOSEST]
    frames = np.sort(np.concatenate([whole, exact]))
    frames = frames[np.append(True, np.diff(frames) > CLOSEST)]
    seconds = (frames - release) / fps
    flies = frames, flight.at(seconds), flight.rotations(seconds)
    begins, last = _spans(result)
    first = int(round(joined.start * fps))
    does = first_motion(ball, wish) if ball is not None else None
    if result.order.act == "kick":
        before = np.array([min(first, last - 1) if does is None else last, last], float)
        lies = before[-2 if does is None else -1 :]
        turns = flies[2][:1] if does is None else _earlier(scene, ball, wish, last, last)[2]
        still = lies, np.repeat(flight.at(np.zeros(1)), len(lies), axis=0), np.repeat(turns, len(lies), axis=0)
        if does is not None and does < last:
            still = _joined(_earlier(scene, ball, wish, does, last - 1), still)
        return *_flying(still, flies), None, []
    taken = first if does is None else max(first, begins)
    if ball is not None:
        taken = taken_from(ball, wish, taken, last)
    rows = np.arange(taken, last + 1)
    held = rows.astype(float), *in_hand(result, rows - first)
    told = []
    if does is not None and does < taken:
        way = _earlier(scene, ball, wish, does, taken - 1)
        away = float(np.linalg.norm(way[1][-1] - held[1][0]))
        if away > FAR:
            told = [f"frame {taken}: the ball jumps to the hand from {away:.1f} m away; let the hand take it before "
                    "(Take Ball), or choose another ball"]
        held = _joined(way, held)
    return *_flying(held, flies), (taken, last), told


def in_hand(result: "Result", rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute positions (N, 3) m and rotations (N, 4) of the held ball at frames (N,) of the whole motion."""
    from ...beyond_mocap.motion.motion import pose_kinematics

    motion, hand = result.joined.motion, _hand(result)
    places, turns = pose_kinematics(motion.skeleton, motion.root_positions[rows], motion.rotations[rows])
    return places[:, hand] + quaternion.rotate(turns[:, hand], result.thrown.grip), turns[:, hand]


def _hand(result: "Result") -> int:
    """Find the joint of the hand that throws."""
    from ...beyond_mocap.motion.humanoid import identify

    side = result.order.limb.partition("_")[0]
    return getattr(identify(result.order.skeleton), side).hand


def _earlier(scene, ball, wish, first: int, last: int):
    """Compute frames (F,), positions (F, 3) m and rotations (F, 4) of the ball without this throw."""
    frames = np.arange(first, last + 1)
    way = way_before(ball, wish, frames)
    places = np.array([place.to_translation() for place in way]) / units_per_metre(scene)
    return frames.astype(float), places, np.array([tuple(place.to_quaternion()) for place in way])


def _flying(before, flies):
    """Join the motion before the release and the flight; the ball's rotation continues from the release."""
    frames, places, turns = flies
    turns = quaternion.multiply(turns, quaternion.multiply(quaternion.inverse(turns[:1]), before[2][-1:]))
    frames, places, turns = _joined(before, (frames, places, turns))
    return frames, places, quaternion.continuous(turns)


def _joined(before, behind):
    """Join two tuples of arrays along the first axis."""
    return tuple(np.concatenate(pair) for pair in zip(before, behind))
