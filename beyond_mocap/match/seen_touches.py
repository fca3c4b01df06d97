"""Which part of a body, on which side, meets the ball where skeletal tracking shows the player who touches it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..ball.tracked import kinds
from ..ball.tracked.solve import SolvedBall, SolvedTouch
from ..library.library import Library
from ..motion.humanoid import Limb, estimate_stature, identify_joints
from ..motion.motion import compute_pose
from ..motion.skeleton import Skeleton
from .known_bodies import SeenBodies, SeenPlayer

_AROUND = 0.1  # s on either side of a touch in which the nearest part is sought: solved times are that uncertain
_NEAR = 0.5  # m from the ball's centre up to which a part may meet it
_CLEARLY = 0.1  # m by which another part has to be nearer than the one that the ball's flight suggests
_BY_HAND = (kinds.THROW_IN, kinds.HAND, kinds.SAVE)
_CROWN = 0.12  # m from the head joint up to the middle of the head

Place = tuple[str, str]
"""Part and side: "foot" or "hand", and "left" or "right"; or "head" or "chest", and ""."""


def name_seen_touches(solved: SolvedBall, bodies: SeenBodies, library: Library) -> tuple[SolvedBall, dict[int, str]]:
    """Name the part and the side of all touches by players whose bodies are seen then.

    Args:
        solved: the ball.
        bodies: what was found of all bodies.
        library: whose skeleton they have.
    Returns:
        The ball, its touches with the part that was seen at it, and the feet's sides by the touch's number.
    """
    touches, sides = list(solved.touches), {}
    for number, touch in enumerate(touches):
        apart = _measure_parts(touch, bodies.players.get(touch.player, SeenPlayer()), library.skeleton)
        if (place := _choose_place(touch.part, apart)) is not None:
            touches[number] = replace(touch, part=place[0])
            sides.update({number: place[1]} if place[0] == "foot" else {})  # of hands it means where they dive
    return replace(solved, touches=tuple(touches)), sides


def _choose_place(part: str, apart: dict[Place, float]) -> Place | None:
    """Choose the place that meets the ball from distances in m: the nearest, but of another part than `part` only if
    that is clearly nearer; None if none is near.
    """
    near = {place: away for place, away in apart.items() if away <= _NEAR}
    return min(near, key=lambda place: near[place] + _CLEARLY * (place[0] != part), default=None)


def _measure_parts(touch: SolvedTouch, player: SeenPlayer, skeleton: Skeleton) -> dict[Place, float]:
    """Measure how near, m, each part of the player comes to the ball at a touch; empty where no body is seen, and for
    balls in the hands.
    """
    if touch.kind in _BY_HAND:
        return {}
    body = next((one for one in player.bodies if one.start <= touch.time <= one.end), None)
    if body is None:
        return {}
    own = skeleton.scale(player.height / estimate_stature(skeleton))
    frames = np.arange(round((touch.time - _AROUND) * body.fps), round((touch.time + _AROUND) * body.fps) + 1)
    frames = frames[(frames >= body.first) & (frames < body.first + len(body))] - body.first
    root, rotations = body.pose
    places, _ = compute_pose(own, root[frames], rotations[frames])
    return {place: float(np.linalg.norm(points - touch.position, axis=-1).min())
            for place, points in _list_points(own, places).items()}


def _list_points(skeleton: Skeleton, places: np.ndarray) -> dict[Place, np.ndarray]:
    """List points (T, N, 3) m of each part that may meet the ball, from joint positions (T, J, 3)."""
    body = identify_joints(skeleton)
    sides: tuple[tuple[str, Limb], ...] = ("left", body.left), ("right", body.right)
    out = {}
    for side, limb in sides:
        foot = places[:, limb.foot]
        toe = places[:, limb.toe_or_foot]
        out["foot", side] = np.stack([foot, 0.5 * (foot + toe), toe], axis=1)
        if limb.hand is not None:
            out["hand", side] = places[:, [limb.hand]]
    if body.head is not None:
        out["head", ""] = places[:, [body.head]] + [0.0, 0.0, _CROWN]
    return {**out, ("chest", ""): places[:, [body.chest]]}
