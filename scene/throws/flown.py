"""The ball of a throw or kick: in the hand or lying, then its flight; and its trajectory as a curve.

Up to the last frame before the release a thrown ball is carried by the hand's bone (`passes.possession`), so that it
stays in the hand when somebody works on the pose. What it did before comes back with `give_back`.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...beyond_mocap.motion import quaternion
from .. import ball as balls
from .. import bake, channels
from ..aimed.shots import CLOSEST, trajectory
from ..measure import frames_per_second, units_per_metre
from ..passes import possession
from ..passes.settings import KEPT
from ..passes.shown import remove
from ..set_aside import bring_back, drop, put_aside
from .settings import MARK, BeyondMocapThrow

if TYPE_CHECKING:
    from .order import Result

NAMES = {"throw": "Thrown Ball", "kick": "Kicked Ball"}


def own_place(scene: bpy.types.Scene, ball: bpy.types.Object, wish: BeyondMocapThrow) -> np.ndarray:
    """(3,) m where a ball lies when nobody kicks it."""
    place = ball.location
    if wish.flown == ball and wish.ball_before.kept:
        place = json.loads(wish.ball_before.stance)[""][1]
    return np.array(place) / units_per_metre(scene)


def show(scene: bpy.types.Scene, body: bpy.types.Object, result: "Result") -> bpy.types.Object:
    """Let the ball go the way of a throw; it is made where there is none. Returns it."""
    wish = body.beyond_mocap_throw
    if wish.flown is not None and wish.flown != wish.ball and not (wish.ball is None and _is_made(wish)):
        give_back(scene, wish)
    kind = result.thrown.ball
    ball = wish.ball or wish.flown
    if ball is None or ball.name not in scene.objects:
        ball = balls.create(bpy.context, NAMES[result.order.act], bake.collection(scene))
        ball[KEPT], wish.flown = True, ball
        drop(wish.ball_before, MARK)
    _let_go(scene, ball)
    if ball == wish.flown and _is_made(wish):
        ball.scale = 3 * (kind.radius / balls.RADIUS,)
    elif not wish.ball_before.kept:
        put_aside(wish.ball_before, ball)
    wish.flown = ball
    channels.discard(ball, MARK)
    ball.rotation_mode = "QUATERNION"
    frames, places, turns, held = keys(scene, wish, result)
    curves = {"location": places * units_per_metre(scene), "rotation_quaternion": turns}
    named = {path: ("Object Transforms", values) for path, values in curves.items()}
    channels.animate(ball, f"{ball.name} path", frames, named)[MARK] = True
    if held is not None:
        side = result.order.limb.partition("_")[0]
        bone = result.order.table.get(f"{side} hand") or result.order.skeleton.names[_hand(result)]
        possession.take(scene, ball, body, bone, *held, how="KEEP")
    wish.curve = trajectory(scene, wish.curve, ball, result.flight)
    return ball


def give_back(scene: bpy.types.Scene, wish: BeyondMocapThrow) -> None:
    """The ball does what it did before; one that was made goes, and so does the trajectory."""
    ball, path = wish.flown, wish.curve
    if path is not None:
        data = path.data
        bpy.data.objects.remove(path)
        if not data.users:
            bpy.data.curves.remove(data)
    if ball is not None:
        _let_go(scene, ball)
        if _is_made(wish):
            channels.discard(ball, MARK)
            remove(ball)
        elif wish.ball_before.kept:
            bring_back(wish.ball_before, ball, MARK)
    drop(wish.ball_before, MARK)
    for name in ("flown", "curve"):
        wish.property_unset(name)


def _is_made(wish: BeyondMocapThrow) -> bool:
    """Whether the ball that flies was made for this throw; one of somebody else's has been put aside."""
    return bool(wish.flown.get(KEPT)) and not wish.ball_before.kept


def _let_go(scene: bpy.types.Scene, ball: bpy.types.Object) -> None:
    """Nobody carries the ball any more."""
    if len(ball.beyond_mocap_ball.holds):
        possession.free(scene, ball)


def keys(
    scene: bpy.types.Scene, wish: BeyondMocapThrow, result: "Result"
) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[int, int] | None]:
    """Frames (F,), places (F, 3) m and rotations (F, 4) of the ball, and the frames on which the hand carries it: from
    and to; None for a kick."""
    fps, flight, joined = frames_per_second(scene), result.flight, result.joined
    release = joined.release * fps
    rest = flight.rests_from if flight.rests_from is not None else flight.end
    whole = np.arange(np.ceil(release + CLOSEST), np.ceil(release + rest * fps) + 1)
    exact = np.append(release, release + flight.bounces * fps)
    exact = exact[np.abs(exact - np.round(exact)) > CLOSEST]
    frames = np.sort(np.concatenate([whole, exact]))
    frames = frames[np.append(True, np.diff(frames) > CLOSEST)]
    seconds = (frames - release) / fps
    places, turns = flight.at(seconds), flight.rotations(seconds)
    last = int(np.floor(release + CLOSEST))
    first = int(round(joined.start * fps))
    if result.order.act == "kick":
        before = np.array([min(first, last - 1), last], float)
        still = np.repeat(flight.at(np.zeros(1)), 2, axis=0)
        return _all(before, still, np.repeat(turns[:1], 2, axis=0), frames, places, turns, None)
    held = np.arange(first, last + 1)
    spots, spun = in_hand(result, held - first)
    return _all(held.astype(float), spots, spun, frames, places, turns, (first, last))


def in_hand(result: "Result", rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places (N, 3) m and rotations (N, 4) of the ball in the hand at frames (N,) of the whole motion."""
    from ...beyond_mocap.motion.motion import pose_kinematics

    motion, hand = result.joined.motion, _hand(result)
    places, turns = pose_kinematics(motion.skeleton, motion.root_positions[rows], motion.rotations[rows])
    return places[:, hand] + quaternion.rotate(turns[:, hand], result.thrown.grip), turns[:, hand]


def _hand(result: "Result") -> int:
    from ...beyond_mocap.motion.humanoid import identify

    side = result.order.limb.partition("_")[0]
    return getattr(identify(result.order.skeleton), side).hand


def _all(before, spots, spun, frames, places, turns, held):
    """Both parts as one; the ball turns in the air as it did when it left."""
    turns = quaternion.multiply(turns, quaternion.multiply(quaternion.inverse(turns[:1]), spun[-1:]))
    both = zip((before, spots, spun), (frames, places, turns))
    joined = [np.concatenate(pair) for pair in both]
    return joined[0], joined[1], quaternion.continuous(joined[2]), held
