"""The problem of a touch: which part meets the ball, from which side, and how far the ball may be moved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ....annotation.ball_contact import build_surfaces, comes_from_hands, find_contact_window, uses_both_hands
from ....annotation.labels import list_labels
from ....annotation.striking import Surface, build_part_surfaces, measure_ball_gap
from ....base.vectors import unit_vector
from ....motion.humanoid import compute_heading_from_positions, identify_joints
from ....motion.track import BALL_RADIUS
from ..contact_geometry import (
    Aim,
    BallRange,
    add_flight_arc,
    choose_aim,
    ease_around,
    place_between_hands,
    solve_contacts,
)
from ..held_ball import HELD_DISTANCE
from ..move_body_part import Body, limb_chain
from .part_reach import level_vector, limit_shift
from .touch_frames import SHORTEST_EASE, TouchFrames

BALL_NOISE, FILLED_NOISE = 0.3, 1.0
"""Metres that the ball may be moved from its place, where it was measured and where the feed has filled it in."""

STOPPING = frozenset(list_labels(ball="takes"))
"""Labels that take the ball."""

_HIGH = frozenset(list_labels(height="high"))
# sine of the ball's elevation as seen from the part
_RISE = {"foot": 0.0, "hand": 0.0, "head": 0.6, "chest": 0.0, "thigh": 0.8}
_IN_THE_AIR = 0.2  # m above which a ball may be met higher or lower
_HANDS_APART = 0.6  # m between the hands beyond which one hand alone catches in a dive


@dataclass(frozen=True, eq=False, kw_only=True)
class TouchProblem:
    """What a touch is solved with.

    Attributes:
        moment: the touch.
        parts: the striking parts.
        shares: (W,) of the shift per frame, for each part.
        ball: (T, 3) m, the ball's trajectory.
        measured: (T,) bool.
        is_held: whether the hands have held the ball until the touch.
        aim: where the part strikes.
        avoid: (line, radius) that the ball must not lie in.
        origin: the first of the body's W frames.
        fps: frames per second.
    """

    moment: TouchFrames
    parts: tuple[Surface, ...]
    shares: tuple[np.ndarray, ...]
    ball: np.ndarray
    measured: np.ndarray
    is_held: bool
    aim: Aim
    avoid: list[tuple]
    origin: int
    fps: float

    @property
    def at(self) -> int:
        """Frame of the moment among the body's frames."""
        return self.moment.frame - self.origin

    def compute_surface_lines(self, body: Body, frame: int) -> np.ndarray:
        """Return the lines of all parts.

        Args:
            body: the body.
            frame: output frame.
        Returns:
            (P, 2, 3) m, both ends of every part's line.
        """
        return np.array([body.surface_line(part, frame - self.origin) for part in self.parts])

    def solve_ball(self, lines: np.ndarray, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Compute the new place of the ball (3,) m, and what each part then lacks (P, 3) m to touch it.

        Args:
            lines: (P, 2, 3) m, the parts' lines.
            frame: output frame.
        """
        part, ball, room = self.parts[0], self.ball[frame], self.compute_ball_range(frame)
        if len(lines) == 2:
            return place_between_hands(lines, part.radius, ball, room)
        solved = solve_contacts(lines[0], part.radius, [self.aim], rise=_RISE[part.part], ball=ball, ball_range=room,
                                avoid=self.avoid)
        return solved.ball[0], solved.need

    def compute_ball_range(self, frame: int) -> BallRange:
        """Return how far the ball may move; a ball on the ground stays there, and one just above it nearly so: a feed's
        heights are noisy, and a ball lifted to a foot would hop there by itself. A filled one may come down to the
        ground. A ball that the hands have held is where they are, at any height. A fixed one stays."""
        if self.moment.is_fixed and frame == self.moment.frame:
            return BallRange(0.0, 0.0)
        if self.is_held:
            return BallRange(np.inf, np.inf)
        whole, lowest = (BALL_NOISE, _IN_THE_AIR) if self.measured[frame] else (FILLED_NOISE, BALL_RADIUS)
        return BallRange(whole, float(np.clip(self.ball[frame, 2] - lowest, 0.0, whole)))


def build_problem(body: Body, moment: TouchFrames, origin: int, contacts, path, measured, height_known,
                   fps: float) -> TouchProblem:
    """Build the problem of a touch: choose parts and aim.

    Args:
        body: the body over the touch's W frames.
        moment: the touch.
        origin: the first of these frames.
        contacts: (W, 2) bool, left and right foot in contact.
        path: (T, 3) m, the ball's trajectory.
        measured: (T,) bool, False where the feed filled the ball in.
        height_known: (T,) bool, where its height is measured.
        fps: frames per second.
    Returns:
        The problem.
    """
    at, choices = moment.frame - origin, build_surfaces(body.skeleton, moment.words)
    if choices[0].part == "hand" and _use_both_hands(body, choices, at, moment.words):
        parts = choices
    else:
        parts = (_choose_part(body, choices, at, contacts=contacts, ball=path[moment.frame], fps=fps),)
    shares = tuple(_compute_share(moment, origin, len(body.root), is_in_contact(contacts, part), fps)
                   for part in parts)
    line, radius = body.surface_line(parts[0], at), parts[0].radius
    if parts[0].part != "foot" or _HIGH & moment.words:
        # without a measured height the ball flies through the part's height
        height = 0.5 * (line[0] + line[1])[2] + _RISE[parts[0].part] * (radius + BALL_RADIUS)
        height = path[moment.frame, 2] if moment.is_fixed else height
        path = add_flight_arc(path, moment.frame, float(height), ~height_known, fps)
    ahead = _choose_direction(body, parts[0], moment, at=at, path=path, fps=fps)
    avoid = _compute_other_leg_lines(body, parts[0], at) if parts[0].part == "foot" else []
    is_held = comes_from_hands(moment.words) and _measure_distance(body, at, path[moment.frame]) < HELD_DISTANCE
    scene = TouchProblem(moment=moment, parts=parts, shares=shares, ball=path, measured=measured,
                          is_held=is_held and not moment.is_fixed, aim=Aim(ahead), avoid=avoid, origin=origin, fps=fps)
    if len(parts) == 2:
        return scene
    aim = choose_aim(line, radius, ahead, rise=_RISE[parts[0].part], ball=path[moment.frame],
                     ball_range=scene.compute_ball_range(moment.frame), avoid=avoid,
                     possible=partial(limit_shift, body, parts[0], at))
    return replace(scene, aim=aim)


def _measure_distance(body: Body, at: int, ball: np.ndarray) -> float:
    """Measure the distance on the ground from pelvis to ball, m."""
    return float(np.linalg.norm(level_vector(ball - body.places[at, identify_joints(body.skeleton).hips])))


def _compute_other_leg_lines(body: Body, foot: Surface, at: int) -> list[tuple]:
    """Return line and radius of the foot and the shin that do not strike."""
    other = next(part for part in build_part_surfaces(body.skeleton, "foot") if part.side != foot.side)
    knee, ankle = body.places[at, list(limb_chain(body.skeleton, other)[1:])]
    return [(body.surface_line(other, at), other.radius), ((knee, ankle), other.radius)]


def _use_both_hands(body: Body, hands: Sequence[Surface], at: int, words: frozenset[str]) -> bool:
    """Return whether all labelled hands reach for the ball: in a dive only to catch it, and if close together."""
    middles = [np.mean(body.surface_line(hand, at), axis=0) for hand in hands]
    near = np.linalg.norm(middles[0] - middles[-1]) < _HANDS_APART
    return not find_contact_window(words) or bool(near and uses_both_hands(words))


def _choose_part(body: Body, choices: Sequence[Surface], at: int, contacts, ball: np.ndarray, fps: float) -> Surface:
    """Choose the part nearest to the ball, a swinging foot before one in contact."""
    def compute_cost(part: Surface) -> float:
        gap = float(measure_ball_gap(body.surface_line(part, at), part.radius, ball))
        speed = np.linalg.norm(_compute_part_velocity(body, part, at, fps))
        return gap + 0.3 * is_in_contact(contacts, part)[at] - 0.05 * speed

    return min(choices, key=compute_cost)


def is_in_contact(contacts: np.ndarray, part: Surface) -> np.ndarray:
    """Return whether a part is a foot in contact, or a thigh above one.

    Args:
        contacts: (W, 2) bool, left and right foot in contact.
        part: the part.
    Returns:
        (W,) bool.
    """
    if part.part not in ("foot", "thigh"):
        return np.zeros(len(contacts), bool)
    return contacts[:, ("left", "right").index(part.side)]


def _compute_share(moment: TouchFrames, origin: int, count: int, is_in_contact: np.ndarray, fps: float) -> np.ndarray:
    """Compute the share (W,) of its shift that a part has at each frame.

    It is 1 while the touch is held, 0 outside the clip's entry and exit and while the foot is in contact, except for
    the shortest ease that a body needs.
    """
    first, last = (frame - origin for frame in moment.held)
    # contact frames before the touch, without a contact that lasts up to the touch itself; the same behind it
    before = np.flatnonzero(is_in_contact[:first] & ~np.logical_and.accumulate(is_in_contact[:first][::-1])[::-1])
    after = np.flatnonzero(is_in_contact[last + 1 :] & ~np.logical_and.accumulate(is_in_contact[last + 1 :]))
    lift, land = before[-1] if len(before) else -np.inf, last + 1 + after[0] if len(after) else np.inf
    least = SHORTEST_EASE * fps
    low = max(moment.low - origin, min(lift, first - least))
    high = min(moment.high - origin, max(land, last + least))
    return ease_around(np.arange(count), low, first, last, high)


def _compute_part_velocity(body: Body, part: Surface, at: int, fps: float) -> np.ndarray:
    """Compute the velocity (3,) m/s of the part's middle."""
    middle = np.mean(body.surface_line(part, slice(max(at - 1, 0), at + 2)), axis=0)
    return (middle[-1] - middle[0]) * fps / max(len(middle) - 1, 1)


def _choose_direction(body: Body, part: Surface, moment: TouchFrames, at: int, path: np.ndarray,
                      fps: float) -> np.ndarray:
    """Choose the direction (3,) level, unit, in which a part strikes.

    A kick drives the ball where the foot moves, corrected towards where it is seen to fly; a player who stops a ball
    has it on the side from which it comes; head, chest and hands have it ahead.
    """
    angle = compute_heading_from_positions(body.skeleton, body.places[at])
    ahead = np.array([np.cos(angle), np.sin(angle), 0.0])
    near, reach = moment.frame, max(int(round(0.1 * fps)), 1)
    coming = level_vector(path[near] - path[max(near - reach, 0)]) / 0.1
    leaving = level_vector(path[min(near + reach, len(path) - 1)] - path[near]) / 0.1
    if part.part == "hand" and find_contact_window(moment.words):
        return unit_vector(-coming, ahead)
    if part.part != "foot":
        return ahead
    # towards the incoming ball, or towards a slow ball's place, mixed with straight ahead
    if STOPPING & moment.words:
        middle = np.mean(body.surface_line(part, at), axis=0)
        incoming = -coming if np.linalg.norm(coming) > 1.0 else level_vector(path[moment.frame] - middle)
        return unit_vector(unit_vector(incoming, ahead) + 0.8 * ahead, ahead)
    swing = level_vector(_compute_part_velocity(body, part, at, fps))
    along = unit_vector(swing, ahead) if np.linalg.norm(swing) > 1.0 else ahead
    return unit_vector(along + 0.5 * unit_vector(leaving, along), along) if np.linalg.norm(leaving) > 3.0 else along
