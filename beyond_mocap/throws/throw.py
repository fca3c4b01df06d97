"""Generate a throw or kick at a target: plan from examples, generate with networks, correct until it hits.

    thrown = throw_at(model, ThrowRequest(target=(18.0, 2.0, 1.2)))

`throws.networks.plan` blends a description from the model's examples, `throws.networks.generate` generates the motion,
`throws.correction` changes it as physics requires, and `ball.flight` computes the flight of the ball.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..ball.flight import Launch, find_crossing, fly
from ..ball.physics import FASTEST, Ball
from ..ball.shot import arcs, is_out_of_reach
from ..base.errors import Cancelled, InputError
from ..base.vectors import arctan2
from ..motion import quaternion
from ..motion.humanoid import identify, stature
from ..motion.mirror import mirror
from ..motion.motion import Motion, cubic_at, place
from ..motion.retargeting.retarget import Retargeter
from ..motion.skeleton import Skeleton
from ..synthetic.throws import FASTEST as FASTEST_HAND
from .correction import FINE, LITTLE, Corrected, corrected
from .letting_go import AtFoot, InHand, leaving
from .networks.chains import EFFECTORS
from .networks.limits import LimbLimits
from .networks.model import ThrowModel
from .networks.plan import Planned, Wish, planned, unlike
from .throw_order import KINDS, Order, Thrown, ball_path, part_of

NEAREST = 1.5
"""Metres over the ground from body to target, at least."""
_HIGHEST = 0.25  # share of the stature: largest height above the ground of a ball that is kicked
STATURES = (0.1, 10.0)
"""Range of the stature, m, of a body that throws."""
_BEYOND_EXAMPLES = 1.2  # highest speed that may be requested, relative to the fastest example
_MORE = 1.04  # lowest planned speed, relative to the slowest launch that reaches the target
_SUITS, _EASY = 1.6, 0.3  # preferred speed relative to that launch, and log ratio of speeds that costs 1
_NEAR = 0.7  # share of the highest speed below which a target reached without air needs no exact check
_STEEPER = np.radians(35.0)  # elevation that may be requested beyond the steepest example
_TOLD_BEYOND = np.radians(2.0)  # excess over joint limits that is reported
_MOST_MOVED, _MOST_MISSED = 0.15, 1.0
"""m: largest displacement of wrist or ankle and largest miss with which a throw is returned."""
_PLANS = 3  # plans that are tried until one hits
_ANOTHER = 0.08  # smallest log ratio between the speeds of two plans
_ROUNDS = 6  # iterations for the start position of the body
_GOES_ON = 1.0  # s of flight beyond the target


def throw_at(
    model: ThrowModel, order: Order, skeleton: Skeleton | None = None,
    progress: Callable[[float, str], None] | None = None, cancelled: Callable[[], bool] | None = None,
) -> Thrown:
    """Generate a throw or kick as requested.

    Args:
        model: the model.
        request: target and conditions.
        skeleton: any humanoid skeleton; None: the model's.
        progress: receives a share of 0 .. 1 and a text.
        cancelled: returns True to stop.
    Raises:
        InputError: if the skeleton lacks the limb or the model was not trained for it, or the target is out of reach
            of people or of the model's examples.
        Cancelled: if `cancelled` returns True.
    """
    def told(share: float, text: str) -> None:
        if cancelled and cancelled():
            raise Cancelled("cancelled")
        if progress:
            progress(share, text)

    told(0.0, "Planning")
    work = _Work(model, order, skeleton or model.skeleton)
    best = None
    for number, plan in enumerate(work.plans()):
        told(0.1 + 0.8 * number / _PLANS, "Generating")
        made = work.generated(plan)
        told(0.1 + 0.8 * (number + 0.6) / _PLANS, "Correcting")
        found = work.corrected(made)
        if best is None or _cost(found) < _cost(best[1]):
            best = made, found
        if found.missed < FINE and found.moved < LITTLE:
            break
    return work.thrown(*best)


@dataclass(frozen=True, eq=False, kw_only=True)
class _Made:
    """A generated motion at its final position, at the requested frame rate and on the requested skeleton.

    Attributes:
        plan: plan that it was generated from.
        motion: the motion.
        release: s of the release.
        network_deviation: m, mean distance of hands and feet from their targets before any correction.
        limits: joint limits of the limb.
    """

    plan: Planned
    motion: Motion
    release: float
    raw: float
    limits: LimbLimits


def _cost(found: Corrected) -> float:
    return found.missed + 0.2 * found.moved


@lru_cache(maxsize=8)
def launches_of(model: ThrowModel, limb: int, ball: Ball) -> tuple[np.ndarray, ...]:
    """Compute how a ball leaves each example of a model, zero for examples of another limb.

    Returns:
        Positions (E, 3) m, velocities (E, 3) m/s and spins (E, 3) rad/s.
    """
    part = part_of(model.skeleton, limb, ball)
    none = np.zeros((3, 3))
    found = [
        leaving(example.motion, part, example.release, example.impact, ball) if example.limb == limb else none
        for example in model.examples
    ]
    return tuple(np.array(values) for values in zip(*found))


class _Work:
    """Generation of one requested throw."""

    def __init__(self, model: ThrowModel, order: Order, skeleton: Skeleton):
        self.model, self.order, self.skeleton = model, order, skeleton
        self.kicks = model.settings.action == "kick"
        self.limb = EFFECTORS.index(order.limb) if order.limb else _usual_limb(model)
        self._check()
        used = {example.limb for example in model.examples}
        self._human = f"the human limit for a {'kick' if self.kicks else 'throw'}"
        self.mirrored = self.limb not in used and self.limb ^ 1 in used
        self.own_limb = self.limb ^ 1 if self.mirrored else self.limb
        kind = order.ball or ("football" if self.kicks else "baseball")
        self.ball = KINDS[kind] if isinstance(kind, str) else kind
        self.target = np.maximum(np.asarray(order.target, float), [-np.inf, -np.inf, self.ball.radius])
        self.warnings: list[str] = []
        if order.target[2] < -self.ball.radius:
            self.warnings.append(
                f"the target is {-order.target[2]:.2f} m below the ground: the ball aims at the point above it"
            )

    def _check(self) -> None:
        """Raise InputError if limb, action, body or speed are impossible."""
        name, what = EFFECTORS[self.limb], self.model.settings.action
        if name.endswith("foot") != self.kicks:
            raise InputError("throw", f"a {what} with the {name.replace('_', ' ')}", "a model trained for it",
                             f"this one was trained for {what}s: choose another model")  # fmt: skip
        body = identify(self.skeleton)
        limb = getattr(body, name.split("_")[0])
        if not self.kicks and None in (limb.upper_arm, limb.lower_arm, limb.hand):
            raise InputError("throw", f"a skeleton without a {name.replace('_', ' ')}", "arms and hands")
        if not STATURES[0] <= stature(self.skeleton) <= STATURES[1]:
            raise InputError("skeleton", f"a body of {stature(self.skeleton):.3g} m",
                             f"{STATURES[0]:g} to {STATURES[1]:g} m", "check the unit")  # fmt: skip
        most = _HIGHEST * stature(self.skeleton)
        if self._lies_high > most:
            raise InputError("ball", f"{self._lies_high:.2f} m above the ground",
                             f"at most {most:.2f} m, in reach of a foot", "move it down")  # fmt: skip
        if not self.model.examples:
            raise InputError("model", "no examples", "examples, from which motions are planned", "train it again")
        most = self.fastest
        if self.order.speed and self.order.speed > most:
            raise InputError("speed", f"{self.order.speed:.0f} m/s", f"at most {most:.0f} m/s, the human limit")

    @property
    def _lies_high(self) -> float:
        """Height (m) above the ground of the centre of the ball that is kicked."""
        place = self.order.ball_place
        return float(place[2]) if place is not None and len(place) > 2 else 0.0

    @property
    def fastest(self) -> float:
        """Highest ball speed (m/s) of people."""
        return FASTEST["foot"] if self.kicks else FASTEST_HAND

    # Planning, in the model's size and with the target straight ahead.

    def plans(self) -> Iterator[Planned]:
        """Iterate over the plans to try: other paces, or other weights, if the first does not hit."""
        for wish, seed in self._wishes():
            yield planned(self.model.examples, self.launches, wish, seed)

    def _wishes(self) -> list[tuple[Wish, int]]:
        """List launch requests, the best first, and seeds."""
        examples = self.model.examples
        places, self.launches, spins = launches_of(self.model, self.own_limb, self.ball)
        own = [n for n, example in enumerate(examples) if example.limb == self.own_limb]
        if not own:
            raise InputError("model", f"no example with the {EFFECTORS[self.limb].replace('_', ' ')}",
                             "examples with this limb")  # fmt: skip
        begin, _ = self._laid(np.median([self._anchor(examples[n], places[n]) for n in own], axis=0))
        ahead = float(np.linalg.norm(self.target[:2] - begin))
        if ahead < NEAREST:
            found = f"{ahead:.2f} m from the body"
            raise InputError("target", found, f"at least {NEAREST:g} m", "move the target or the body away")
        place = np.median(places[own], axis=0)
        start, end = np.array([place[0], 0.0, place[2]]), np.array([ahead, 0.0, self.target[2]])
        spin, fastest = np.median(spins[own], axis=0), float(np.linalg.norm(self.launches[own], axis=1).max())
        self._check_far(start, end, spin, fastest)
        self.arcs = arcs(start, end, self.ball, spin)
        if self.arcs.slowest > self.fastest:
            raise self._too_far(f"{self.arcs.slowest:.0f} m/s or more", self.fastest, self._human)
        self._check_reach(fastest)
        self._check_steep(own, min(self.fastest, _BEYOND_EXAMPLES * fastest))
        wishes, seed = self._by_pace(own, ahead), self.order.seed
        return [(wish, seed) for wish in wishes] if len(wishes) > 1 else [(wishes[0], seed + n) for n in range(_PLANS)]

    def _anchor(self, example, place: np.ndarray) -> np.ndarray:
        """Return the point (2,) m of an example, normalised frame, that the request positions."""
        if self.order.ball_place is not None:
            return place[:2]
        if self.order.over is not None:
            return cubic_at(example.motion, np.array([example.release]))[0][0, :2]
        return np.zeros(2)

    def _where(self) -> np.ndarray:
        """Return the requested position (2,) m."""
        order = self.order
        given = next((value for value in (order.start, order.over, order.ball_place) if value is not None), (0.0, 0.0))
        return np.asarray(given, float)[:2]

    def _laid(self, anchor: np.ndarray) -> tuple[np.ndarray, float]:
        """Compute origin (2,) m and rotation (rad) of the normalised frame in the world.

        Its point `anchor` (2,) m is at the requested position, and its X axis points to the target.
        """
        spot = self._where()
        begin, turn = spot, 0.0
        for _ in range(_ROUNDS):
            way = self.target[:2] - begin
            turn = float(np.arctan2(way[1], way[0]))
            begin = spot - quaternion.turned_level(anchor, np.array(turn))
        return begin, turn

    def _check_far(self, start: np.ndarray, end: np.ndarray, spin: np.ndarray, own: float) -> None:
        """Raise InputError if the target is clearly too far, before any slow computation."""
        model = f"since the model's fastest example has {own:.0f}"
        for most, what in ((self.fastest, self._human), (_BEYOND_EXAMPLES * own, model)):
            slowest = _slowest_without_air(start, end, self.ball.gravity)
            if slowest > most or slowest > _NEAR * most and is_out_of_reach(start, end, self.ball, most, spin):
                raise self._too_far(f"more than {most:.0f} m/s", most, what)

    def _too_far(self, takes: str, most: float, what: str) -> InputError:
        """Build the error for a target that needs more than `most` m/s; `what` gives the reason of that limit."""
        far = float(np.linalg.norm(self.target[:2] - self._where()))
        return InputError("target", f"{far:.0f} m away, which needs {takes}", f"at most {most:.0f} m/s, {what}",
                          "choose a nearer or lower target")  # fmt: skip

    def _check_steep(self, own: list[int], most: float) -> None:
        """Raise InputError if the ball has to leave far more steeply than in any of the examples."""
        along, _, up = self.arcs.at(most)
        steep, known = arctan2(up, along), self.launches[own]
        steepest = float(arctan2(known[:, 2], np.hypot(known[:, 0], known[:, 1])).max())
        if steep > steepest + _STEEPER:
            found = f"the ball has to leave at an elevation of {np.degrees(steep):.0f} degrees"
            most = np.degrees(steepest + _STEEPER)
            expected = f"at most {most:.0f}, since the steepest example has {np.degrees(steepest):.0f}"
            raise InputError("target", found, expected, "move it further away or lower")

    def _check_reach(self, own: float) -> None:
        """Raise InputError if the speed does not reach the target, or is too far above the examples' `own` m/s."""
        slowest = self.arcs.slowest
        asked = self.order.speed or 0.0
        if asked and asked < slowest:
            raise InputError("speed", f"{asked:.1f} m/s", f"at least {slowest:.1f} m/s to reach the target",
                             "set a higher speed")  # fmt: skip
        if max(slowest, asked) > _BEYOND_EXAMPLES * own:
            what, found = ("speed", f"{asked:.0f} m/s") if asked else ("target", f"it needs {slowest:.0f} m/s")
            most = f"at most {_BEYOND_EXAMPLES * own:.0f} m/s, since the model's fastest example has {own:.0f}"
            raise InputError(what, found, most, "choose a lower speed, or train on faster examples")

    def _by_pace(self, own: list[int], ahead: float) -> list[Wish]:
        """List launch requests, the best first, each of another speed.

        The requested speed, or of those that reach the target the ones most similar to the examples, preferably not
        faster than the distance requires.
        """
        thrown = np.linalg.norm(self.launches[own], axis=1)
        speeds = np.array([self.order.speed]) if self.order.speed else np.maximum(thrown, _MORE * self.arcs.slowest)
        wishes = [self._wish_at(float(speed), ahead) for speed in speeds]
        impacts = np.array([self.model.examples[n].impact for n in own])
        away = [float(np.sort(unlike(self.launches[own], impacts, wish))[:3].mean()) for wish in wishes]
        suits = np.clip(_SUITS * self.arcs.slowest, thrown.min(), thrown.max())
        chosen: list[Wish] = []
        for number in np.argsort(away + (np.log(speeds / suits) / _EASY) ** 2, kind="stable"):
            if all(abs(np.log(speeds[number] / wish.speed)) > _ANOTHER for wish in chosen) and len(chosen) < _PLANS:
                chosen.append(wishes[number])
        return chosen

    def _wish_at(self, speed: float, ahead: float) -> Wish:
        """Build the launch request of a speed (m/s) for a target `ahead` m away."""
        launch = self.arcs.at(speed)
        return Wish(speed=speed, elevation=float(np.arctan2(launch[2], launch[0])), distance=ahead,
                    height=float(self.target[2]), limb=self.own_limb)

    # Generating, and placing the motion where it is requested.

    def generated(self, plan: Planned) -> _Made:
        """Generate the motion of a plan at its final position, with the requested frame rate and skeleton."""
        from .networks.frame_step import stepper
        from .networks.generate import generate

        found = generate(self.model, plan.description)
        motion, release = found.motion, plan.description.release / plan.description.fps
        own = motion = self._at_rate(motion)
        if self.mirrored:
            motion = mirror(motion)
        if not motion.skeleton.same_bones(self.skeleton):
            motion = Retargeter(motion, self.skeleton).carry(motion)
        part = part_of(self.skeleton, self.limb, self.ball)
        limits = LimbLimits.of(
            stepper(self.model).limits, own, part_of(own.skeleton, self.own_limb, self.ball).chain(own), shown=motion,
            joints=part.chain(motion), mirrored=self.mirrored,
        )
        frame = release * motion.fps
        hips = motion.root_positions[0, :2]
        motion = place(motion, 0.0, (-hips[0], -hips[1], 0.0))
        ahead = np.array([plan.description.impact[0], 0.0, self.target[2]])
        left, velocity, _ = leaving(motion, part, frame, ahead, self.ball)
        anchor = np.zeros(2)
        if self.order.ball_place is not None:
            anchor = left[:2]
        elif self.order.over is not None:
            anchor = cubic_at(motion, np.array([frame]))[0][0, :2]
        begin, turn = self._laid(anchor)
        return _Made(plan=plan, motion=place(motion, turn, (*begin, 0.0)), release=release,
                     raw=float(np.mean(found.raw)), limits=limits)

    def _at_rate(self, motion: Motion) -> Motion:
        fps = self.order.fps or motion.fps
        if abs(fps - motion.fps) < 1e-9:
            return motion
        count = int(np.floor(motion.duration * fps + 1e-6)) + 1
        return Motion(motion.skeleton, *cubic_at(motion, np.arange(count) * (motion.fps / fps)), fps)

    # Correcting, and computing the flight of the ball.

    def _part(self) -> InHand | AtFoot:
        """Build the hand or foot that releases the ball."""
        lies = None
        if self.order.ball_place is not None:
            lies = np.array([*self._where(), max(self._lies_high, self.ball.radius)])
        return part_of(self.skeleton, self.limb, self.ball, lies)

    def corrected(self, made: _Made) -> Corrected:
        """Correct the motion so that the ball hits, or passes as near as possible."""
        order, frame = self.order, made.release * made.motion.fps
        return corrected(made.motion, self._part(), frame, target=self.target, ball=self.ball, freedom=order.freedom,
                         speed=order.speed, hold=made.limits.held)  # fmt: skip

    def thrown(self, made: _Made, found: Corrected) -> Thrown:
        """Build the result, with flight, ball path and warnings."""
        part, motion = self._part(), made.motion
        beyond = float(made.limits.beyond(found.motion).max())
        self._check_body(found)
        left = found.frame / motion.fps
        start = 0.0 if self.order.release_time is None else self.order.release_time - left
        launch = Launch(start + left, found.position, found.velocity, found.spin)
        flight = fly(launch, self.ball, found.seconds + _GOES_ON + found.motion.duration)
        impact = find_crossing(flight, self.target)
        self._tell(found, impact, beyond)
        return Thrown(
            motion=found.motion, start_time=start, release=left, limb=EFFECTORS[self.limb], ball=self.ball,
            grip=getattr(part, "grip", None),
            path=ball_path(found.motion, part, flight, start, found.seconds + _GOES_ON), launch=launch, flight=flight,
            target=self.target, impact=impact, moved=found.moved, shift=found.shift, turned=found.turned,
            pace=found.pace, later=found.later, elsewhere=found.elsewhere, slowest=self.arcs.slowest,
            asked_speed=self.order.speed or float(np.linalg.norm(found.velocity)), raw_deviation=made.raw,
            beyond=beyond, examples=tuple(zip(made.plan.names, map(float, made.plan.weights))),
            warnings=tuple(self.warnings),
        )  # fmt: skip

    def _check_body(self, found: Corrected) -> None:
        """Raise InputError if the ball reaches the target only with an implausible pose, or never."""
        action = "kick" if self.kicks else "throw"
        if found.seconds <= 0.0 or found.missed > _MOST_MISSED:
            what = "the ball does not reach it"
        elif found.moved > _MOST_MOVED:
            what = f"it needs {'an ankle' if self.kicks else 'a wrist'} moved by {100 * found.moved:.0f} cm"
        else:
            return
        raise InputError("target", what, f"one that a {action} like the examples reaches",
                         "move a near target further away, a far one nearer or lower")  # fmt: skip

    def _tell(self, found: Corrected, impact: np.ndarray, beyond: float) -> None:
        """Collect warnings about the result."""
        error = float(np.linalg.norm(impact - self.target))
        what, speed = ("ankle" if self.kicks else "wrist"), float(np.linalg.norm(found.velocity))
        if not error <= 0.10:
            missed = f"by {error:.2f} m" if np.isfinite(error) else "and does not reach it"
            self.warnings.append(f"the ball misses the target {missed}: the body cannot reach the required pose")
        if found.moved > 0.05:
            self.warnings.append(f"the {what} is moved by {100 * found.moved:.0f} cm so that the ball hits")
        if beyond > _TOLD_BEYOND:
            self.warnings.append(f"a joint bends {np.degrees(beyond):.0f} degrees further than in any of the examples")
        if speed > self.fastest:
            self.warnings.append(
                f"the ball leaves at {speed:.0f} m/s, above the human limit of {self.fastest:.0f}: a body of "
                f"{stature(self.skeleton):.1f} m moves faster"
            )
        if self.order.speed and abs(speed - self.order.speed) > 0.1 * self.order.speed:
            self.warnings.append(f"the ball leaves at {speed:.1f} m/s instead of {self.order.speed:.1f}")


def _slowest_without_air(start: np.ndarray, end: np.ndarray, gravity: float) -> float:
    """Compute the speed (m/s) below which no ball gets from start (3,) m to end (3,) m, without air."""
    up, far = float(end[2] - start[2]), float(np.linalg.norm(end - start))
    return float(np.sqrt(max(gravity * (up + far), 0.0)))


def _usual_limb(model: ThrowModel) -> int:
    """Return the limb that most examples use, the right one if there are no examples."""
    limbs = [example.limb for example in model.examples]
    return int(np.bincount(limbs).argmax()) if limbs else (3 if model.settings.action == "kick" else 1)
