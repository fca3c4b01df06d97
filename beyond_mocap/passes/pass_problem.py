"""What all steps of planning a passing scene share: the strikes' sites, obstacles to a ball, the first ball's start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..ball.aim import solve_launches
from ..ball.aim_problem import AimResult
from ..ball.batch import build_balls, simulate_balls
from ..ball.contact import Tool, convert_to_world
from ..ball.physics import HUMAN_BALL_SPEEDS, Ball, compute_rolling_spin
from ..base.errors import UserCancelledError
from ..base.vectors import cross_on_ground
from ..motion import quaternion
from .pass_cost import compute_player_cost
from .pass_scene import GROUND, Net, Pass, PassScene, find_server
from .strike_choice import StrikeMoments

ON_TARGET = 0.02
"""Metres from its target within which a ball counts as arrived."""
SERVE_DISTANCE, SERVE_HEIGHT = 0.4, 1.2
"""Metres in front of the serving player, and above the ground, from where the first ball comes."""
SERVE_SECONDS, SERVE_SECONDS_PER_METRE, LONGEST_SERVE = 0.5, 0.07, 3.0
"""Seconds that a serve flies, how many more for each metre, and the most."""
SAMPLE_TIMES = np.linspace(0.1, 2.5, 25)
"""Seconds after a strike at which natural trajectories are sampled."""
SPEEDS = {"toss": (4.5, 8.0), "pass": (5.0, 12.0), "attack": (9.0, 25.0)}
"""Lowest and highest launch speed of each kind of pass, m/s."""
SPINS = {"toss": -0.1, "pass": -0.1, "attack": 0.2}
"""Spin of each kind as a share of the spin with which a ball rolls at its speed.

Struck from below it spins back; struck hard it spins forward.
"""
RISES = {"toss": (0.7, 0.95), "pass": (0.4, 0.8), "attack": (-0.4, 0.3)}
"""Sines of the lowest and highest launch angle above the ground of each kind of pass."""
ARRIVAL_STEP = 1e-3  # s before arrival at which a ball's velocity is read
_STEPS = 30  # pieces into which a flight is cut


@dataclass(frozen=True, eq=False, kw_only=True)
class Site:
    """The place, part and means of one strike.

    Attributes:
        player: name.
        place: (2,) m, world frame.
        facing: heading before the strike, rad.
        kind: "toss", "pass", "attack", or "receive" (the last strike).
        part: part that strikes.
        tool: what is in the hand.
        size: size of the body over that of the library's skeleton.
        moments: moments with which the player can strike.
        requested: the pass that goes out; None for the last strike.
    """

    player: str
    place: np.ndarray
    facing: float
    kind: str
    part: str
    tool: Tool | None
    size: float
    moments: StrikeMoments
    requested: Pass | None

    @property
    def height(self) -> float:
        """Approximate height in m above the ground at which a ball is met here."""
        middle = 0.5 * (self.moments.part_states.start + self.moments.part_states.end)
        return float(np.median(middle[:, 2]))


@dataclass(frozen=True, eq=False)
class NaturalFlights:
    """Natural trajectories of a strike's ball (Fig. 6, black).

    Attributes:
        starts: (M, 3) m.
        velocities: (M, 3) m/s.
        chosen_index: index of the one that was taken.
    """

    starts: np.ndarray
    velocities: np.ndarray
    chosen_index: int


@dataclass(frozen=True, eq=False, kw_only=True)
class Link:
    """A chosen strike.

    Attributes:
        moment: the option, a single moment.
        facing: rad.
        seconds: travel time of the ball to the next strike, s.
        velocity: (3,) m/s, approximate velocity with which the ball leaves.
        cost: m/s, how badly the motion and its flight fit, without the cost of playing a motion again.
        natural: the natural trajectories it was chosen from.
    """

    moment: StrikeMoments
    facing: float
    seconds: float
    velocity: np.ndarray
    cost: float
    natural: NaturalFlights


class PassProblem:
    """A scene with the sites of all its strikes; the last one is where the last pass ends.

    Attributes:
        passes: the passes that leave each site except the last.
        others: for each pass, names and places (2,) m of the players that have no part in it.
        last: index of the last site.
    """

    def __init__(self, scene: PassScene, sites: list[Site], ball: Ball, cancelled: Callable[[], bool]):
        self.scene, self.sites, self.ball, self.cancelled = scene, sites, ball, cancelled
        self.last = len(sites) - 1
        self.passes = [site.requested for site in sites[:-1]]
        self.others = self._list_others()

    def check_cancelled(self) -> None:
        """Raise UserCancelledError if the user cancels."""
        if self.cancelled():
            raise UserCancelledError("cancelled")

    def describe_pass(self, number: int) -> str:
        """Describe a pass for messages."""
        one = self.passes[number]
        return f"pass {number + 1}, from {one.giver} to {one.receiver}"

    def find_fastest(self, number: int) -> float:
        """Highest speed in m/s that a human gives a ball at a strike."""
        return HUMAN_BALL_SPEEDS.get(self.sites[number].part, HUMAN_BALL_SPEEDS["foot"])

    def find_origin(self, number: int) -> np.ndarray:
        """Place (2,) m from where the ball of a strike comes."""
        if number:
            return self.sites[number - 1].place
        serve = self.scene.serve
        if serve == GROUND:
            return self.find_target(0)[:2]
        if isinstance(serve, tuple):
            return np.array(serve[:2])
        return np.array(self.scene.find_player(serve or find_server(self.scene)).place)

    def find_target(self, number: int) -> np.ndarray:
        """Approximate target (3,) m of a strike's ball; the last one goes back to where it came from."""
        other = self.sites[number + 1 if number < self.last else number - 1]
        return np.array([*other.place, other.height])

    def compute_blocked_cost(self, number: int, trajectories: np.ndarray) -> np.ndarray:
        """Compute how far flights of a pass go through each of its `others`.

        Args:
            number: index of the pass.
            trajectories: (N, S, 3) m, trajectories.
        Returns:
            (N, P) m/s of cost.
        """
        return compute_player_cost(trajectories, np.array([place for _, place in self.others[number]]).reshape(-1, 2))

    def clears_net(self, trajectories: np.ndarray) -> np.ndarray:
        """Whether trajectories clear the net, if there is one.

        Args:
            trajectories: (N, S, 3) m, trajectories.
        Returns:
            (N,) bool.
        """
        net = self.scene.net
        return np.ones(len(trajectories), bool) if net is None else is_clear_of_net(trajectories, self.ball.radius, net)

    def solve_launches(self, number: int, start: np.ndarray, target: np.ndarray,
                       seconds: np.ndarray) -> tuple[AimResult, np.ndarray]:
        """Solve the launches of a pass.

        Args:
            number: index of the pass.
            start: (S, 3) m.
            target: (3,) m.
            seconds: (S,) s of travel.
        Returns:
            launches: S launches.
            possible: (S,) bool, what a human can give and what clears the net.
        """
        spin = compute_spin(start, target, seconds, self.ball, self.sites[number].kind)
        aimed = solve_launches(start, target, self.ball, seconds=seconds, bounces=self.passes[number].bounces,
                               spin=spin, fastest=self.find_fastest(number))
        clear = self.clears_net(simulate_flights(start, aimed.velocity, spin, seconds, self.ball))
        return aimed, aimed.possible & (aimed.miss <= ON_TARGET) & clear

    def place_ball(self, number: int, link: Link, normal: np.ndarray) -> np.ndarray:
        """Compute the ball's centre (3,) m on the part of a strike toward `normal` (3,), world frame."""
        own = quaternion.rotate(quaternion.from_up_angle(np.array([-link.facing])), normal[None])
        place = convert_to_world(link.moment.place_ball(own, self.ball.radius), self.sites[number].place,
                                 np.array([link.facing]))[0]
        if number == 0 and self.scene.serve == GROUND:
            place[2] = self.ball.radius
        return place

    def find_serving_place(self, place: np.ndarray) -> np.ndarray:
        """Compute the place (3,) m from where the first ball comes to `place` (3,) m."""
        serve = self.scene.serve
        if isinstance(serve, tuple):
            return np.maximum(np.array(serve), [-np.inf, -np.inf, self.ball.radius])
        origin = self.find_origin(0)
        toward = place[:2] - origin
        return np.array([*(origin + SERVE_DISTANCE * toward / max(np.linalg.norm(toward), 1e-9)), SERVE_HEIGHT])

    def find_serving_seconds(self, place: np.ndarray) -> float:
        """Compute the flight time in s of the first ball to `place` (3,) m, on whole frames: a slow throw that clears
        the net.
        """
        start, fps = self.find_serving_place(place), self.scene.fps
        slowest = SERVE_SECONDS + SERVE_SECONDS_PER_METRE * float(np.linalg.norm(place[:2] - start[:2]))
        tried = np.ceil(np.linspace(slowest, max(LONGEST_SERVE, slowest), 8) * fps) / fps
        starts = np.tile(start, (len(tried), 1))
        aimed = solve_launches(starts, place, self.ball, tried, 0)
        good = (aimed.miss <= ON_TARGET) & self.clears_net(simulate_flights(starts, aimed.velocity, None, tried,
                                                                            self.ball))
        return float(tried[np.argmax(good)])

    def _list_others(self) -> list[list[tuple[str, np.ndarray]]]:
        """List, for each pass, the names and places of the players that have no part in it."""
        places = {player.name: np.array(player.place, float) for player in self.scene.players}
        out = []
        for one in self.passes:
            out.append([(name, place) for name, place in places.items() if name not in (one.giver, one.receiver)])
            if one.at is not None:
                places[one.receiver] = np.array(one.at, float)
        return out


def rotate_about_up(vectors: np.ndarray, angle: float) -> np.ndarray:
    """Rotate vectors (N, 3) by `angle` rad about the vertical."""
    return quaternion.rotate(quaternion.from_up_angle(np.array([angle])), vectors)


def limit_launch(velocities: np.ndarray, kind: str) -> np.ndarray:
    """Limit natural velocities (N, 3) m/s to the speeds and launch angles of a kind of pass."""
    speed = np.linalg.norm(velocities, axis=1)
    level = np.linalg.norm(velocities[:, :2], axis=1)
    rise = np.clip(velocities[:, 2] / np.maximum(speed, 1e-9), *RISES[kind])
    ahead = np.sqrt(1.0 - rise**2) / np.maximum(level, 1e-9)
    direction = np.concatenate([velocities[:, :2] * ahead[:, None], rise[:, None]], axis=1)
    return direction * np.clip(speed, *SPEEDS[kind])[:, None]


def compute_spin(starts: np.ndarray, target: np.ndarray, seconds: np.ndarray, ball: Ball, kind: str) -> np.ndarray:
    """Compute the spin of balls of a kind.

    Args:
        starts: (N, 3) m.
        target: (3,) or (N, 3) m.
        seconds: (N,) s of travel.
        ball: the ball.
        kind: kind of pass.
    Returns:
        (N, 3) rad/s.
    """
    return SPINS[kind] * compute_rolling_spin((target - starts) / np.asarray(seconds)[:, None], ball)


def simulate_flights(starts: np.ndarray, velocities: np.ndarray, spin: np.ndarray | None, seconds: np.ndarray,
                     ball: Ball) -> np.ndarray:
    """Simulate the flights of N balls, each at even steps of its own travel time.

    Args:
        starts: (N, 3) m.
        velocities: (N, 3) m/s at launch.
        spin: (N, 3) rad/s, or None.
        seconds: (N,) s of travel.
        ball: the ball.
    Returns:
        (N, _STEPS + 1, 3) m.
    """
    balls = build_balls(starts, velocities, spin, ball)
    out = [balls.position]
    for _ in range(_STEPS):
        balls = simulate_balls(balls, ball, seconds / _STEPS)
        out.append(balls.position)
    return np.stack(out, axis=1)


def compute_arrivals(starts: np.ndarray, velocities: np.ndarray, spin: np.ndarray | None, seconds: np.ndarray,
                     ball: Ball) -> np.ndarray:
    """Compute the velocities with which balls arrive; a ball that is met on the ground has not bounced.

    Args:
        starts: (N, 3) m.
        velocities: (N, 3) m/s at launch.
        spin: (N, 3) rad/s, or None.
        seconds: (N,) s of travel.
        ball: the ball.
    Returns:
        (N, 3) m/s, ARRIVAL_STEP before arrival.
    """
    return simulate_balls(build_balls(starts, velocities, spin, ball), ball, seconds - ARRIVAL_STEP).velocity


def is_clear_of_net(trajectories: np.ndarray, radius: float, net: Net) -> np.ndarray:
    """Whether balls go over the net wherever they cross it.

    Args:
        trajectories: (N, S, 3) m, trajectories.
        radius: of the balls, m.
        net: the net.
    Returns:
        (N,) bool.
    """
    start, end = np.array(net.start), np.array(net.end)
    along = end - start
    aside = cross_on_ground(along, trajectories[..., :2] - start) / np.linalg.norm(along)
    # segments whose ends lie on different sides of the net's line, and the point of crossing
    crosses = (aside[:, :-1] > 0.0) != (aside[:, 1:] > 0.0)
    share = aside[:, :-1] / np.where(crosses, aside[:, :-1] - aside[:, 1:], 1.0)
    at = trajectories[:, :-1] + np.clip(share, 0.0, 1.0)[..., None] * (trajectories[:, 1:] - trajectories[:, :-1])
    on = ((at[..., :2] - start) @ along) / (along @ along)
    width = radius / np.linalg.norm(along)
    # the net ends half a ball's width beyond its posts, and is a ball's radius higher
    hit = crosses & (on > -width) & (on < 1.0 + width) & (at[..., 2] < net.height + radius)
    return ~hit.any(axis=1)
