"""Plan the launch of a throw or kick: speeds that reach the target and are most similar to the model's examples."""

from __future__ import annotations

import numpy as np

from ..ball.physics import HUMAN_BALL_SPEEDS, Ball
from ..ball.shot import is_out_of_reach, solve_arcs
from ..base.errors import InputError
from ..base.vectors import arctan2
from ..motion import quaternion
from ..motion.motion import sample_frames_cubic
from ..synthetic.throws import FASTEST as FASTEST_HAND
from .example_launches import compute_launches
from .networks.model import ThrowModel
from .networks.plan import LaunchRequest, compute_dissimilarity
from .throw_request import ThrowRequest

MIN_TARGET_DISTANCE = 1.5
"""Metres over the ground from body to target, at least."""
MAX_PLANS = 3
"""Plans that are tried until one hits."""
_MAX_SPEED_RATIO = 1.2  # highest speed that may be requested, relative to the fastest example
_MIN_SPEED_RATIO = 1.04  # lowest planned speed, relative to the slowest launch that reaches the target
# preferred speed relative to that launch, and log ratio of speeds that costs 1
_PREFERRED_SPEED_RATIO, _SPEED_TOLERANCE = 1.6, 0.3
_CHECK_RATIO = 0.7  # share of the highest speed below which a target reached without air needs no exact check
_MAX_EXTRA_ELEVATION = np.radians(35.0)  # elevation that may be requested beyond the steepest example
_MIN_SPEED_DIFFERENCE = 0.08  # smallest log ratio between the speeds of two plans
_ROUNDS = 6  # iterations for the start position of the body


class LaunchPlanner:
    """The launches that bring a ball to one target, in the model's size and with the target straight ahead.

    Attributes:
        launches: how the ball can leave the model's examples.
        arcs: all launches that reach the target, once they are listed.
        human_limit: what the highest speed of people is called in messages.
    """

    def __init__(self, model: ThrowModel, request: ThrowRequest, limb: int, ball: Ball, target: np.ndarray):
        """Collect the launches of the examples.

        Args:
            model: the model.
            request: target and conditions.
            limb: number of the limb with which the examples throw.
            ball: the ball.
            target: (3,) m, world frame, not below the ground.
        Raises:
            InputError: if no example is of that limb.
        """
        self.request, self.limb, self.ball, self.target = request, limb, ball, target
        self.max_speed = find_max_speed(model.settings.action)
        self.human_limit = f"the human limit for a {model.settings.action}"
        self.launches = compute_launches(model, limb, ball)

    def list_launch_requests(self) -> list[tuple[LaunchRequest, int]]:
        """List the launches to try, the best first: other paces, or other weights, if the first does not hit.

        Returns:
            Launch requests, each with the seed of its plan.
        Raises:
            InputError: if the target is out of reach of people or of the model's examples.
        """
        launches = self.launches
        anchors = [self._find_anchor(*one) for one in zip(launches.examples, launches.positions)]
        begin, _ = self.place_frame(np.median(anchors, axis=0))
        ahead = float(np.linalg.norm(self.target[:2] - begin))
        if ahead < MIN_TARGET_DISTANCE:
            found = f"{ahead:.2f} m from the body"
            raise InputError("target", found, f"at least {MIN_TARGET_DISTANCE:g} m", "move the target or the body away")
        place = np.median(launches.positions, axis=0)
        start, end = np.array([place[0], 0.0, place[2]]), np.array([ahead, 0.0, self.target[2]])
        spin = np.median(launches.spins, axis=0)
        fastest = float(np.linalg.norm(launches.velocities, axis=1).max())
        self._check_distance(start, end, spin, fastest)
        self.arcs = solve_arcs(start, end, self.ball, spin)
        if self.arcs.slowest > self.max_speed:
            raise self._describe_too_far(f"{self.arcs.slowest:.0f} m/s or more", self.max_speed, self.human_limit)
        self._check_speed(fastest)
        self._check_elevation(min(self.max_speed, _MAX_SPEED_RATIO * fastest))
        requests, seed = self._rank_launch_requests(ahead), self.request.seed
        if len(requests) == 1:
            return [(requests[0], seed + n) for n in range(MAX_PLANS)]
        return [(request, seed) for request in requests]

    def _find_anchor(self, example, place: np.ndarray) -> np.ndarray:
        """Return the point (2,) m of an example, normalised frame, that the request positions."""
        if self.request.ball_place is not None:
            return place[:2]
        if self.request.over is not None:
            return sample_frames_cubic(example.motion, np.array([example.release]))[0][0, :2]
        return np.zeros(2)

    def find_position(self) -> np.ndarray:
        """Find the requested position (2,) m, world frame."""
        order = self.request
        given = next((value for value in (order.start, order.over, order.ball_place) if value is not None), (0.0, 0.0))
        return np.asarray(given, float)[:2]

    def place_frame(self, anchor: np.ndarray) -> tuple[np.ndarray, float]:
        """Place the normalised frame in the world, its X axis pointing to the target.

        Args:
            anchor: (2,) m, its point that is at the requested position.
        Returns:
            Origin (2,) m and rotation in rad.
        """
        position = self.find_position()
        begin, turn = position, 0.0
        for _ in range(_ROUNDS):
            to_target = self.target[:2] - begin
            turn = float(np.arctan2(to_target[1], to_target[0]))
            begin = position - quaternion.rotate_level(anchor, np.array(turn))
        return begin, turn

    def _check_distance(self, start: np.ndarray, end: np.ndarray, spin: np.ndarray, own: float) -> None:
        """Raise InputError if the target is clearly too far, before any slow computation."""
        model = f"since the model's fastest example has {own:.0f}"
        for most, what in ((self.max_speed, self.human_limit), (_MAX_SPEED_RATIO * own, model)):
            slowest = _compute_min_speed(start, end, self.ball.gravity)
            if slowest > most or slowest > _CHECK_RATIO * most and is_out_of_reach(start, end, self.ball, most, spin):
                raise self._describe_too_far(f"more than {most:.0f} m/s", most, what)

    def _describe_too_far(self, takes: str, most: float, what: str) -> InputError:
        """Build the error for a target that needs more than `most` m/s; `what` gives the reason of that limit."""
        far = float(np.linalg.norm(self.target[:2] - self.find_position()))
        return InputError("target", f"{far:.0f} m away, which needs {takes}", f"at most {most:.0f} m/s, {what}",
                          "choose a nearer or lower target")  # fmt: skip

    def _check_elevation(self, most: float) -> None:
        """Raise InputError if the ball has to leave far more steeply than in any of the examples."""
        along, _, up = self.arcs.at(most)
        elevation, known = arctan2(up, along), self.launches.velocities
        steepest = float(arctan2(known[:, 2], np.hypot(known[:, 0], known[:, 1])).max())
        if elevation > steepest + _MAX_EXTRA_ELEVATION:
            found = f"the ball has to leave at an elevation of {np.degrees(elevation):.0f} degrees"
            most = np.degrees(steepest + _MAX_EXTRA_ELEVATION)
            expected = f"at most {most:.0f}, since the steepest example has {np.degrees(steepest):.0f}"
            raise InputError("target", found, expected, "move it further away or lower")

    def _check_speed(self, own: float) -> None:
        """Raise InputError if the speed does not reach the target, or is too far above the examples' `own` m/s."""
        slowest = self.arcs.slowest
        requested = self.request.speed or 0.0
        if requested and requested < slowest:
            raise InputError("speed", f"{requested:.1f} m/s", f"at least {slowest:.1f} m/s to reach the target",
                             "set a higher speed")  # fmt: skip
        if max(slowest, requested) > _MAX_SPEED_RATIO * own:
            what, found, action = ("speed", f"{requested:.1f} m/s", "choose a lower speed") if requested else (
                "target", f"it needs {slowest:.1f} m/s", "choose a nearer target")
            most = f"at most {_MAX_SPEED_RATIO * own:.1f} m/s, since the model's fastest example has {own:.1f}"
            raise InputError(what, found, most, f"{action}, or train on faster examples")

    def _rank_launch_requests(self, ahead: float) -> list[LaunchRequest]:
        """List launch requests, the best first, each of another speed.

        The requested speed, or of those that reach the target the ones most similar to the examples, preferably not
        faster than the distance requires.
        """
        launches = self.launches.velocities
        thrown = np.linalg.norm(launches, axis=1)
        speeds = np.array([self.request.speed]) if self.request.speed else np.maximum(thrown, _MIN_SPEED_RATIO
                * self.arcs.slowest)
        requests = [self._build_launch_request(float(speed), ahead) for speed in speeds]
        impacts = np.array([example.impact for example in self.launches.examples])
        dissimilarity = [float(np.sort(compute_dissimilarity(launches, impacts, request))[:3].mean())
                         for request in requests]
        preferred_speed = np.clip(_PREFERRED_SPEED_RATIO * self.arcs.slowest, thrown.min(), thrown.max())
        chosen: list[LaunchRequest] = []
        for number in np.argsort(dissimilarity + (np.log(speeds / preferred_speed) / _SPEED_TOLERANCE) ** 2,
                                 kind="stable"):
            if all(abs(np.log(speeds[number] / request.speed)) > _MIN_SPEED_DIFFERENCE
                   for request in chosen) and len(chosen) < MAX_PLANS:
                chosen.append(requests[number])
        return chosen

    def _build_launch_request(self, speed: float, ahead: float) -> LaunchRequest:
        """Build the launch request of a speed (m/s) for a target `ahead` m away."""
        launch = self.arcs.at(speed)
        return LaunchRequest(speed=speed, elevation=float(np.arctan2(launch[2], launch[0])), distance=ahead,
                             height=float(self.target[2]), limb=self.limb)


def _compute_min_speed(start: np.ndarray, end: np.ndarray, gravity: float) -> float:
    """Compute the speed (m/s) below which no ball gets from start (3,) m to end (3,) m, without air."""
    up, far = float(end[2] - start[2]), float(np.linalg.norm(end - start))
    return float(np.sqrt(max(gravity * (up + far), 0.0)))


def find_max_speed(action: str) -> float:
    """Find the highest ball speed of people in m/s, by action: "throw" or "kick"."""
    return HUMAN_BALL_SPEEDS["foot"] if action == "kick" else FASTEST_HAND
