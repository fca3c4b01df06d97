"""What a ball does before it is thrown or kicked: keyed, thrown before, or carried by others for a while."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

from ...beyond_mocap.base.errors import InputError
from ..core import channels
from ..core.measure import units_per_metre
from ..core.set_aside import stance_of
from ..passes import possession
from .settings import BeyondMocapThrow


def place_at(scene: bpy.types.Scene, ball: bpy.types.Object, wish: BeyondMocapThrow, frame: int) -> np.ndarray:
    """(3,) m where a ball is on a frame without this throw; InputError where somebody carries it then."""
    for hold in _others(ball, wish):
        if hold.first <= frame < hold.last:
            raise InputError(f"ball {ball.name}", f"{_name(hold)} carries it on frame {frame}", "a ball that lies",
                             "choose another frame, or free the ball")
    place = way(ball, wish, np.array([frame]))[0].to_translation()
    return np.array(place) / units_per_metre(scene)


def moves(ball: bpy.types.Object, wish: BeyondMocapThrow) -> int | None:
    """The first frame on which a ball does something without this throw; None for one that lies all the time."""
    ends = channels.keyed_range(_own(ball, wish)[0])
    firsts = [hold.first - 1 for hold in _others(ball, wish)] + ([ends[0]] if ends is not None else [])
    return min(firsts) if firsts else None


def way(ball: bpy.types.Object, wish: BeyondMocapThrow, frames: np.ndarray) -> list[Matrix]:
    """Where a ball is on frames (F,) without this throw, units; as if nobody carried it while somebody does."""
    curves, stance = _own(ball, wish)
    found, ends = possession.way_of(curves, stance, frames), channels.keyed_range(curves)
    for hold in sorted(_others(ball, wish), key=lambda hold: hold.last):
        if ends is None or ends[1] <= hold.last:  # it stays where it was let go
            action, slot = channels.playing(ball)
            shown = channels.curves(action, slot) if action is not None else {}
            dropped = possession.way_of(shown, stance_of(ball)[""], np.array([hold.last]))[0]
            found = [dropped if frame >= hold.last else place for frame, place in zip(frames, found)]
    return found


def taken_from(ball: bpy.types.Object, wish: BeyondMocapThrow, first: int, last: int) -> int:
    """The frame, of first .. last, from which on the hand has a ball that it lets go on `last`: when others have done
    with it. InputError where they have not."""
    for hold in sorted(_others(ball, wish), key=lambda hold: hold.last):
        if hold.first < last and first < hold.last:
            first = hold.last
            if first >= last - 1:
                raise InputError(
                    f"ball {ball.name}", f"{_name(hold)} carries it on frames {hold.first} to {hold.last}",
                    "a ball that nobody else carries by then", "choose a later frame, or free the ball",
                )
    return first


def flies_for(ball: bpy.types.Object, body: bpy.types.Object) -> bpy.types.Object | None:
    """Another armature whose throw, not kept yet, this ball shows; one that was deleted counts no more, though its ball
    keeps it in the file."""
    return next(
        (one for one in bpy.data.objects if one.type == "ARMATURE" and one != body and one.beyond_mocap_throw.made
         and one.beyond_mocap_throw.flown == ball and one.users_scene), None,
    )  # fmt: skip


def _own(ball: bpy.types.Object, wish: BeyondMocapThrow) -> tuple[dict, list]:
    """The curves of a ball's own way without this throw, and how it stands."""
    own = ball.beyond_mocap_ball.before
    if wish.flown == ball and wish.ball_before.kept:
        return possession.played_before(wish.ball_before)
    if own.kept:
        return possession.played_before(own)
    action, slot = channels.playing(ball)
    return channels.curves(action, slot) if action is not None else {}, stance_of(ball)[""]


def _others(ball: bpy.types.Object, wish: BeyondMocapThrow) -> list:
    """The stretches in which the ball is carried, without this throw's."""
    return [hold for hold in ball.beyond_mocap_ball.holds if not (wish.flown == ball and hold.name == wish.hold)]


def _name(hold) -> str:
    return hold.body.name if hold.body is not None else "somebody"
