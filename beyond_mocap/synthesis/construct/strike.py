"""Bring the ball and the striking part together: at each key moment the part is on the ball's surface, eased in and
out.

First the ball moves, within the noise of its measurement, to where the recorded foot (head, chest, hand) strikes. The
limb does the rest by two-bone inverse kinematics, or the spine by bending, within the reach of a body; where that is
not enough the pelvis steps towards the ball within the noise of its own track (`step_to_ball`); what remains is
reported. A kick lasts a hundredth of a second, so between the two frames around the key moment the ball moves with the
foot; a ball that is taken stays longer on it (`give`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...annotation.ball_contact import (
    build_surfaces,
    comes_from_hands,
    find_contact_window,
    measure_contact_gap,
    uses_both_hands,
)
from ...annotation.labels import list_labels
from ...annotation.striking import Surface, build_part_surfaces, measure_ball_gap
from ...base.vectors import unit_vector
from ...motion.humanoid import compute_heading_from_positions, identify_joints
from ...motion.motion import compute_pose
from ...motion.skeleton import Skeleton
from ...motion.track import BALL_RADIUS
from .calm_foot import calm_foot
from .contact_geometry import (
    Aim,
    BallRange,
    add_flight_arc,
    choose_aim,
    ease_around,
    place_between_hands,
    shift_ball_eased,
    solve_contacts,
)
from .give import give_with_ball
from .held_ball import HELD_DISTANCE
from .move_body_part import (
    MAX_ANGLE,
    MAX_SWING,
    Body,
    LimbReference,
    Swing,
    bend_spine,
    compute_swing_shift,
    hold_foot,
    limb_chain,
    limit_to_ground,
    move_limb,
    solve_swing,
    swing_thigh,
)
from .step_to_ball import step_to_ball

BALL_NOISE, FILLED_NOISE = 0.3, 1.0
"""Metres that the ball may be moved from its place, where it was measured and where the feed has filled it in."""

# m, largest move of a part from the recording
MAX_SHIFT = {"foot": 0.45, "hand": 0.4, "head": 0.2, "chest": 0.12, "thigh": 0.1}
PELVIS_RANGE = (0.20, 0.64)  # m on the ground from pelvis to striking foot in measured kicks, unless recorded further
OUT_OF_REACH = 0.15  # m of remaining gap above which the body does not reach at all, and plays as recorded
MAX_DROP = 0.04  # m, largest drop of the pelvis
_LONGEST_EASE, _SHORTEST_EASE = 0.5, 0.12  # s before and after a strike in which the body is eased
# sine of the ball's elevation as seen from the part
_RISE = {"foot": 0.0, "hand": 0.0, "head": 0.6, "chest": 0.0, "thigh": 0.8}
_IN_THE_AIR = 0.2  # m above which a ball may be met higher or lower
_HANDS_APART = 0.6  # m between the hands beyond which one hand alone catches in a dive
_STOPPING = frozenset(list_labels(ball="takes"))
_HIGH = frozenset(list_labels(height="high"))
_MISSED = 0.002  # m of remaining gap from which on the pelvis steps towards the ball
_ROUNDS, _CLOSE = 4, 5e-4  # most rounds of an iteration, and m of change at which it ends


@dataclass(frozen=True)
class Touch:
    """A key moment in which the ball is met.

    Attributes:
        frame: output frame, fractional.
        words: labels of the clip that plays there, sides after mirroring.
        entry: frames before `frame` within which the body may be changed.
        leave: frames after it.
        misses: whether the body reaches for the ball and misses it by design (`near_miss`).
    """

    frame: float
    words: tuple[str, ...]
    entry: float
    leave: float
    misses: bool = False


@dataclass(frozen=True, eq=False)
class StrikeResult:
    """A motion with the ball met at every touch.

    Attributes:
        root: (T, 3) m, world.
        rotations: (T, J, 4) local.
        ball: (T, 3) m, its centre.
        gap: (K,) m between the surfaces at the frame nearest to each touch; NaN where the labels touch no ball or there
            is no ball, as in the next two.
        ball_shift: (K,) m on the ground that the ball was moved there.
        moved: (K,) m that the part was moved.
    """

    root: np.ndarray
    rotations: np.ndarray
    ball: np.ndarray
    gap: np.ndarray
    ball_shift: np.ndarray
    moved: np.ndarray


def strike_ball(
    skeleton: Skeleton, root: np.ndarray, rotations: np.ndarray, contacts: np.ndarray, ball: np.ndarray,
    touches: Sequence[Touch], fps: float, *, measured: np.ndarray | None = None, height_known: np.ndarray | None = None,
) -> StrikeResult:
    """Bring ball and body together at every touch, within the reach of a body.

    Frames outside the touches' windows stay bit for bit.

    Args:
        skeleton: the skeleton.
        root: (T, 3) m, the motion on the pitch, feet planted.
        rotations: (T, J, 4) local.
        contacts: (T, 2) bool, left and right foot in contact; a striking foot changes only between lift-off and
            landing.
        ball: (T, 3) m, its centre, NaN where it is unknown.
        touches: where the ball is met.
        fps: frames per second.
        measured: (T,) bool, False where the feed filled the ball in; None: measured everywhere.
        height_known: (T,) bool, where the ball's height is measured; None: everywhere. Elsewhere the ball lies on the
            ground, except at high touches, to which it rises and from which it falls freely.
    """
    count = len(root)
    measured, height_known = (np.ones(count, bool) if flags is None else np.asarray(flags, bool)
                              for flags in (measured, height_known))
    root, rotations, samples = (np.array(values, dtype=float) for values in (root, rotations, ball))
    path, moved = samples.copy(), np.full(len(touches), np.nan)
    touches = [_move_to_contact(skeleton, root, rotations, feed=samples, touch=touch, fps=fps) for touch in touches]
    for number, moment in _iter_touch_frames(skeleton, touches, count, fps):
        if not np.isfinite(samples[list(moment.held)]).all():
            continue
        span = slice(max(moment.low, 0), min(moment.high, count - 1) + 1)
        body = Body.from_pose(skeleton, root[span], rotations[span])
        scene = _build_problem(body, moment, span.start, contacts=contacts[span], path=path, measured=measured,
                               height_known=height_known, fps=fps)
        reached, moved[number] = _reach_ball(scene, body)
        reached = _calm_taking_foot(scene, reached, contacts[span], fps)
        root[span], rotations[span] = reached.root, reached.rotations
        places = [scene.solve_ball(scene.compute_surface_lines(reached, frame), frame)[0] for frame in moment.held]
        path = shift_ball_eased(scene.ball, moment.held, np.array(places), moment.bounds, fps)
        path = give_with_ball(skeleton, root, rotations, path, held=moment.held, words=moment.words,
                              until=moment.bounds[1], fps=fps)
    gap, shift = _measure_gaps(skeleton, root, rotations, feed=samples, path=path, touches=touches)
    return StrikeResult(root, rotations, path, gap=gap, ball_shift=shift, moved=moved)


def _move_to_contact(skeleton: Skeleton, root, rotations, feed, touch: Touch, fps: float) -> Touch:
    """Move a touch to the frame at which a hand passes the ball nearest.

    Only where the labels allow for that and the ball is out of reach at the key moment itself.
    """
    latest = touch.frame + find_contact_window(touch.words) * fps
    first, last = (find_nearest_frame(frame, len(root)) for frame in (touch.frame, latest))
    if first == last or not np.isfinite(feed[first : last + 1]).all():
        return touch
    places, world = compute_pose(skeleton, root[first : last + 1], rotations[first : last + 1])
    gaps = measure_contact_gap(skeleton, places, world, touch.words, feed[first : last + 1])
    later = int(np.argmin(gaps))
    if not later or gaps[0] < BALL_NOISE:
        return touch
    return replace(touch, frame=float(first + later), entry=touch.entry + later, leave=touch.leave - later)


@dataclass(frozen=True, kw_only=True)
class _TouchFrames:
    """A touch in frames.

    Attributes:
        words: labels of the clip.
        frame: the nearest frame.
        held: the two frames around it, in which the touch is held.
        low: frame before which the body does not change.
        high: frame after which it does not.
        bounds: held frames of the touches before and after.
    """

    words: frozenset[str]
    frame: int
    held: tuple[int, int]
    low: int
    high: int
    bounds: tuple[int, int]


def _iter_touch_frames(skeleton: Skeleton, touches: Sequence[Touch], count: int, fps: float):
    """Generate (number, moment) of every touch that some part can serve, in order of time."""
    shortest, longest = _SHORTEST_EASE * fps, _LONGEST_EASE * fps
    order = sorted((t.frame, k) for k, t in enumerate(touches)
                   if not t.misses and build_surfaces(skeleton, t.words))
    held = [compute_contact_frames(frame, count) for frame, _ in order]
    # held frames of all touches, with sentinels far outside on both sides, so ends[place + 1] is this touch
    ends = [(-count, -count), *held, (2 * count, 2 * count)]
    for place, (frame, number) in enumerate(order):
        touch, (first, last) = touches[number], held[place]
        before, after = ends[place][1], ends[place + 2][0]
        low = max(int(first - np.clip(touch.entry, shortest, longest)), before)
        high = min(int(np.ceil(last + np.clip(touch.leave, shortest, longest))), after)
        yield number, _TouchFrames(words=frozenset(touch.words), frame=find_nearest_frame(frame, count),
                                   held=held[place], low=low, high=high, bounds=(before, after))


def find_nearest_frame(frame: float, count: int) -> int:
    """Return the whole frame, of `count`, nearest to a fractional one."""
    return int(np.clip(np.rint(frame), 0, count - 1))


def compute_contact_frames(frame: float, count: int) -> tuple[int, int]:
    """Return the two frames, of `count`, around a fractional one in which a touch is held.

    Twice the same where the frame is nearly whole.
    """
    if abs(frame - find_nearest_frame(frame, count)) < 0.02:
        frame = find_nearest_frame(frame, count)
    return find_nearest_frame(np.floor(frame), count), find_nearest_frame(np.ceil(frame), count)


@dataclass(frozen=True, eq=False, kw_only=True)
class _TouchProblem:
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

    moment: _TouchFrames
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
        """Return both ends (P, 2, 3) m of every part's line."""
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
        ground. A ball that the hands have held is where they are, at any height."""
        if self.is_held:
            return BallRange(np.inf, np.inf)
        whole, lowest = (BALL_NOISE, _IN_THE_AIR) if self.measured[frame] else (FILLED_NOISE, BALL_RADIUS)
        return BallRange(whole, float(np.clip(self.ball[frame, 2] - lowest, 0.0, whole)))


def _build_problem(body: Body, moment: _TouchFrames, origin: int, contacts, path, measured, height_known,
                   fps: float) -> _TouchProblem:
    """Build the scene of a touch: choose parts and aim."""
    at, choices = moment.frame - origin, build_surfaces(body.skeleton, moment.words)
    if choices[0].part == "hand" and _use_both_hands(body, choices, at, moment.words):
        parts = choices
    else:
        parts = (_choose_part(body, choices, at, contacts=contacts, ball=path[moment.frame], fps=fps),)
    shares = tuple(_compute_share(moment, origin, len(body.root), _is_in_contact(contacts, part), fps)
                   for part in parts)
    line, radius = body.surface_line(parts[0], at), parts[0].radius
    if parts[0].part != "foot" or _HIGH & moment.words:
        # without a measured height the ball flies through the part's height
        height = 0.5 * (line[0] + line[1])[2] + _RISE[parts[0].part] * (radius + BALL_RADIUS)
        path = add_flight_arc(path, moment.frame, float(height), ~height_known, fps)
    ahead = _choose_direction(body, parts[0], moment, at=at, path=path, fps=fps)
    avoid = _compute_other_leg_lines(body, parts[0], at) if parts[0].part == "foot" else []
    is_held = comes_from_hands(moment.words) and _measure_distance(body, at, path[moment.frame]) < HELD_DISTANCE
    scene = _TouchProblem(moment=moment, parts=parts, shares=shares, ball=path, measured=measured,
                          is_held=is_held, aim=Aim(ahead), avoid=avoid, origin=origin, fps=fps)
    if len(parts) == 2:
        return scene
    aim = choose_aim(line, radius, ahead, rise=_RISE[parts[0].part], ball=path[moment.frame],
                     ball_range=scene.compute_ball_range(moment.frame), avoid=avoid,
                     possible=partial(_limit_shift, body, parts[0], at))
    return replace(scene, aim=aim)


def _measure_distance(body: Body, at: int, ball: np.ndarray) -> float:
    """Measure the distance on the ground from pelvis to ball, m."""
    return float(np.linalg.norm(_level_vector(ball - body.places[at, identify_joints(body.skeleton).hips])))


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
        return gap + 0.3 * _is_in_contact(contacts, part)[at] - 0.05 * speed

    return min(choices, key=compute_cost)


def _is_in_contact(contacts: np.ndarray, part: Surface) -> np.ndarray:
    """Return (W,) bool: whether the part is a foot in contact, or a thigh above one."""
    if part.part not in ("foot", "thigh"):
        return np.zeros(len(contacts), bool)
    return contacts[:, ("left", "right").index(part.side)]


def _compute_share(moment: _TouchFrames, origin: int, count: int, is_in_contact: np.ndarray, fps: float) -> np.ndarray:
    """Compute the share (W,) of its shift that a part has at each frame.

    It is 1 while the touch is held, 0 outside the clip's entry and exit and while the foot is in contact, except for
    the shortest ease that a body needs.
    """
    first, last = (frame - origin for frame in moment.held)
    # contact frames before the touch, without a contact that lasts up to the touch itself; the same behind it
    before = np.flatnonzero(is_in_contact[:first] & ~np.logical_and.accumulate(is_in_contact[:first][::-1])[::-1])
    after = np.flatnonzero(is_in_contact[last + 1 :] & ~np.logical_and.accumulate(is_in_contact[last + 1 :]))
    lift, land = before[-1] if len(before) else -np.inf, last + 1 + after[0] if len(after) else np.inf
    least = _SHORTEST_EASE * fps
    low = max(moment.low - origin, min(lift, first - least))
    high = min(moment.high - origin, max(land, last + least))
    return ease_around(np.arange(count), low, first, last, high)


def _compute_part_velocity(body: Body, part: Surface, at: int, fps: float) -> np.ndarray:
    """Compute the velocity (3,) m/s of the part's middle."""
    middle = np.mean(body.surface_line(part, slice(max(at - 1, 0), at + 2)), axis=0)
    return (middle[-1] - middle[0]) * fps / max(len(middle) - 1, 1)


def _choose_direction(body: Body, part: Surface, moment: _TouchFrames, at: int, path: np.ndarray,
                      fps: float) -> np.ndarray:
    """Choose the direction (3,) level, unit, in which a part strikes.

    A kick drives the ball where the foot moves, corrected towards where it is seen to fly; a player who stops a ball
    has it on the side from which it comes; head, chest and hands have it ahead.
    """
    angle = compute_heading_from_positions(body.skeleton, body.places[at])
    ahead = np.array([np.cos(angle), np.sin(angle), 0.0])
    near, reach = moment.frame, max(int(round(0.1 * fps)), 1)
    coming = _level_vector(path[near] - path[max(near - reach, 0)]) / 0.1
    leaving = _level_vector(path[min(near + reach, len(path) - 1)] - path[near]) / 0.1
    if part.part == "hand" and find_contact_window(moment.words):
        return unit_vector(-coming, ahead)
    if part.part != "foot":
        return ahead
    # towards the incoming ball, or towards a slow ball's place, mixed with straight ahead
    if _STOPPING & moment.words:
        middle = np.mean(body.surface_line(part, at), axis=0)
        incoming = -coming if np.linalg.norm(coming) > 1.0 else _level_vector(path[moment.frame] - middle)
        return unit_vector(unit_vector(incoming, ahead) + 0.8 * ahead, ahead)
    swing = _level_vector(_compute_part_velocity(body, part, at, fps))
    along = unit_vector(swing, ahead) if np.linalg.norm(swing) > 1.0 else ahead
    return unit_vector(along + 0.5 * unit_vector(leaving, along), along) if np.linalg.norm(leaving) > 3.0 else along


def _level_vector(v: np.ndarray) -> np.ndarray:
    """Return a vector (3,) without its height."""
    return v * [1.0, 1.0, 0.0]


def _reach_ball(scene: _TouchProblem, body: Body) -> tuple[Body, float]:
    """Bring the parts of a body to the ball, within their reach; also return how far they were moved, m.

    Where the limb alone does not reach, the pelvis steps towards the ball.
    """
    own = scene.compute_surface_lines(body, scene.moment.frame)
    if np.linalg.norm(scene.solve_ball(own, scene.moment.frame)[1]) < _CLOSE:
        return body, 0.0
    reached, lines, missing = _swing_to_ball(scene, body)
    if np.linalg.norm(missing, axis=1).max() > _MISSED:
        side = scene.parts[0].side if scene.parts[0].part in ("foot", "thigh") else ""
        stepped = step_to_ball(body, side, scene.at, missing.mean(axis=0), share=scene.shares[0], fps=scene.fps)
        again = _swing_to_ball(scene, stepped)
        if np.linalg.norm(again[2]) < np.linalg.norm(missing):
            reached, lines, missing = again
    if np.linalg.norm(missing, axis=1).min() > OUT_OF_REACH:
        return body, 0.0
    return reached, float(np.linalg.norm(np.mean(lines, axis=1) - np.mean(own, axis=1), axis=1).max())


def _swing_to_ball(scene: _TouchProblem, body: Body) -> tuple[Body, np.ndarray, np.ndarray]:
    """Move the parts of a body towards the ball; also return their lines and what they lack (P, 3) m there.

    Requested shifts and what the body can do are solved alternately, since a nearly straight limb yields softly and a
    spine moves on an arc.
    """
    lines = scene.compute_surface_lines(body, scene.moment.frame)
    limbs = [LimbReference.from_body(body, limb_chain(body.skeleton, part)) for part in scene.parts
             if part.part in MAX_SWING]
    shifts, moved_body = np.zeros((len(scene.parts), 3)), body
    for _ in range(_ROUNDS):
        requested = _solve_shifts(scene, body, lines, shifts)
        if np.linalg.norm(requested - shifts) < _CLOSE:
            break
        moved_body, shifts = _move_parts(scene, body, limbs, requested), requested
        lines = scene.compute_surface_lines(moved_body, scene.moment.frame)
    if not np.array_equal(moved_body.root, body.root):  # the pelvis has sunk, the foot that does not strike stays
        human = identify_joints(body.skeleton)
        other = human.right if scene.parts[0].side == "left" else human.left
        moved_body = Body.from_pose(body.skeleton, moved_body.root,
                                    hold_foot(body, other, moved_body.root, moved_body.rotations))
    return moved_body, lines, scene.solve_ball(lines, scene.moment.frame)[1]


def _calm_taking_foot(scene: _TouchProblem, body: Body, contacts: np.ndarray, fps: float) -> Body:
    """Slow down the foot that takes a ball; contacts (W, 2) bool."""
    part, (first, last) = scene.parts[0], scene.moment.held
    if part.part != "foot" or not _STOPPING & scene.moment.words:
        return body
    return calm_foot(body, part, (first - scene.origin, last - scene.origin), _is_in_contact(contacts, part), fps)


def _solve_shifts(scene: _TouchProblem, body: Body, lines: np.ndarray, shifts: np.ndarray) -> np.ndarray:
    """Compute the shifts that bring parts to the ball, within what a body can do.

    Args:
        lines: (P, 2, 3) m, the parts' lines with the shifts below.
        shifts: (P, 3) m.
    Returns:
        (P, 3) m.
    """
    requested = shifts
    for _ in range(_ROUNDS):
        _, needs = scene.solve_ball(lines + (requested - shifts)[:, None], scene.moment.frame)
        if np.linalg.norm(needs) < _CLOSE:
            break
        pairs, before = zip(scene.parts, requested, needs), requested
        requested = np.array([_limit_shift(body, part, scene.at, shift + need) for part, shift, need in pairs])
        if np.linalg.norm(requested - before) < _CLOSE:
            break
    return requested


def _limit_shift(body: Body, part: Surface, at: int, shift: np.ndarray) -> np.ndarray:
    """Limit a shift (3,) m to what a body can do: not too far, no limb below the ground or beyond its joints."""
    shift = shift * min(1.0, MAX_SHIFT[part.part] / max(np.linalg.norm(shift), 1e-9))
    if part.part == "foot":
        shift = limit_to_ground(body, part, at, _limit_pelvis_distance(body, part, at, shift))
    if part.part in MAX_SWING and None not in (chain := limb_chain(body.skeleton, part)):
        shift = compute_swing_shift(body, chain, _solve_part_swing(body, part, at, shift), np.arange(len(body.root))
                                    == at)[at]
    return shift


def _limit_pelvis_distance(body: Body, part: Surface, at: int, shift: np.ndarray) -> np.ndarray:
    """Limit the shift (3,) m of a foot to PELVIS_RANGE from the pelvis on the ground."""
    pelvis, middle = body.places[at, identify_joints(body.skeleton).hips], np.mean(body.surface_line(part, at), axis=0)
    away = _level_vector(middle + shift - pelvis)
    own, requested = np.linalg.norm(_level_vector(middle - pelvis)), np.linalg.norm(away)
    ranged = np.clip(requested, min(PELVIS_RANGE[0], float(own)), max(PELVIS_RANGE[1], float(own)))
    return shift + away * (ranged / max(requested, 1e-9) - 1.0)


def _solve_part_swing(body: Body, part: Surface, at: int, shift: np.ndarray) -> Swing:
    """Solve the limb's swing that moves a part by `shift` (3,) m; the pelvis sinks where its leg is too short."""
    chain = limb_chain(body.skeleton, part)
    place = body.places[at, chain[2]] + shift
    lowered = _compute_drop(body, chain, at, place) if part.part == "foot" else 0.0
    return solve_swing(body, chain, at, place=place, max_turn=MAX_SWING[part.part], lowered=lowered)


def _compute_drop(body: Body, chain: tuple[int, int, int], at: int, ankle: np.ndarray) -> float:
    """Compute how far the pelvis sinks so that the leg reaches the place (3,) of its ankle, m, at most MAX_DROP."""
    hip, knee, own = body.places[at, list(chain)]
    upper, lower = np.linalg.norm(knee - hip), np.linalg.norm(own - knee)
    # law of cosines: length of the leg at its largest knee angle
    length = np.sqrt(upper**2 + lower**2 - 2.0 * upper * lower * np.cos(MAX_ANGLE))
    length, level = max(length, np.linalg.norm(own - hip)), np.linalg.norm(_level_vector(ankle - hip))
    return float(np.clip(hip[2] - ankle[2] - np.sqrt(max(length**2 - level**2, 0.0)), 0.0, MAX_DROP))


def _move_parts(scene: _TouchProblem, body: Body, limbs: Sequence[LimbReference], shifts: np.ndarray) -> Body:
    """Move each part of the body by its shift (3,) m, weighted by its share."""
    root, rotations = body.root, body.rotations
    if scene.parts[0].part == "thigh":
        rotations = swing_thigh(body, scene.parts[0], scene.at, shifts[0], scene.shares[0])
    elif not limbs:
        rotations = bend_spine(body, scene.parts[0], scene.at, shifts[0], scene.shares[0])
    for part, limb, shift, share in zip(scene.parts, limbs, shifts, scene.shares):
        swing = _solve_part_swing(body, part, scene.at, shift)
        moves = compute_swing_shift(body, limb.chain, swing, share)
        moves = limit_to_ground(body, part, slice(None), moves) if part.part == "foot" else moves
        root = root - share[:, None] * [0.0, 0.0, swing.lowered]
        rotations = move_limb(body, limb, moves, root, rotations)
    return Body.from_pose(body.skeleton, root, rotations)


def _measure_gaps(skeleton: Skeleton, root, rotations, feed, path, touches) -> tuple[np.ndarray, np.ndarray]:
    """Measure gap (K,) m and level shift of the ball (K,) m at the frame nearest to each touch."""
    frames = np.array([find_nearest_frame(touch.frame, len(root)) for touch in touches], dtype=int)
    places, world = compute_pose(skeleton, root[frames], rotations[frames])
    rows = zip(places, world, touches, path[frames])
    gaps = [measure_contact_gap(skeleton, place, turn, touch.words, ball) for place, turn, touch, ball in rows]
    shift = np.linalg.norm((path - feed)[frames, :2], axis=1)
    return np.abs(np.array(gaps, dtype=float)), np.where(np.isfinite(gaps), shift, np.nan)
