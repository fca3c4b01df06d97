"""What all steps of planning a passing scene share: who strikes where with what, what stands in a ball's way, and where
the first ball comes from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..ball.aim import Aimed, aim
from ..ball.contact import Tool, in_world
from ..ball.physics import FASTEST, Ball
from ..base.errors import Cancelled
from ..motion import quaternion
from .pass_costs import clears_net, out_of_the_way, spun, ways_of
from .pass_scene import GROUND, Pass, PassScene, served_by
from .strike_moments import StrikeMoments

ON_TARGET = 0.02
"""Metres beside its target with which a ball has come to it."""

SERVED_FROM, SERVED_HEIGHT = 0.4, 1.2
"""Metres before who serves, and above the ground, from where the ball comes in."""

SERVED_SECONDS, SERVED_PER_METRE, LONGEST_SERVE = 0.5, 0.07, 3.0
"""How long it flies, how much longer for each metre, and at most."""


@dataclass(frozen=True, eq=False)
class Site:
    """Where, with what and how one of the strikes is to be made.

    player: his name. place (2,) m; facing rad before it. kind: toss, pass, attack, or receive (the last one). part;
    tool. size: of the body against the library's. moments: what it can strike with. asked: the pass that goes out, None
    for the last strike.
    """

    player: str
    place: np.ndarray
    facing: float
    kind: str
    part: str
    tool: Tool | None
    size: float
    moments: StrikeMoments
    asked: Pass | None

    @property
    def height(self) -> float:
        """Metres above the ground at which a ball is met here, about."""
        middle = 0.5 * (self.moments.struck.start + self.moments.struck.end)
        return float(np.median(middle[:, 2]))


@dataclass(frozen=True, eq=False)
class Natural:
    """The balls' natural ways of a strike (Fig. 6, black): starts, velocities (M, 3), chosen: which of them was
    taken."""

    starts: np.ndarray
    velocities: np.ndarray
    chosen: int


@dataclass(frozen=True, eq=False)
class Link:
    """A strike as chosen: the option (a single moment), its facing rad, the seconds that the ball travels on from it,
    and about which velocity (3,) m/s it leaves with."""

    moment: StrikeMoments
    facing: float
    seconds: float
    velocity: np.ndarray
    natural: Natural


class Court:
    """A scene with the sites of all its strikes, the last one where the last pass ends. passes: those that go out of
    the sites but the last; others: for each pass, who has nothing to do with it, and where (2,) m he stands by then."""

    def __init__(self, scene: PassScene, sites: list[Site], ball: Ball, cancelled: Callable[[], bool]):
        self.scene, self.sites, self.ball, self.cancelled = scene, sites, ball, cancelled
        self.last = len(sites) - 1
        self.passes = [site.asked for site in sites[:-1]]
        self.others = self._standing_by()

    def check(self) -> None:
        """Cancelled where the user wants out."""
        if self.cancelled():
            raise Cancelled("cancelled")

    def name(self, number: int) -> str:
        """What a pass is called in messages."""
        one = self.passes[number]
        return f"pass {number + 1}, from {one.giver} to {one.receiver}"

    def fastest(self, number: int) -> float:
        """m/s that a human gives a ball at a strike."""
        return FASTEST.get(self.sites[number].part, FASTEST["foot"])

    def whence(self, number: int) -> np.ndarray:
        """(2,) m: where the ball of a strike comes from."""
        if number:
            return self.sites[number - 1].place
        serve = self.scene.serve
        if serve == GROUND:
            return self.toward(0)[:2]
        if isinstance(serve, tuple):
            return np.array(serve[:2])
        return np.array(self.scene.player(serve or served_by(self.scene)).place)

    def toward(self, number: int) -> np.ndarray:
        """(3,) m: where the ball of a strike goes, about; the last one's back to whence it came."""
        other = self.sites[number + 1 if number < self.last else number - 1]
        return np.array([*other.place, other.height])

    def in_the_way(self, number: int, ways: np.ndarray) -> np.ndarray:
        """(N, P): how far flights of a pass, on their ways (N, S, 3) m, go through each of its `others`."""
        return out_of_the_way(ways, np.array([place for _, place in self.others[number]]).reshape(-1, 2))

    def clear(self, ways: np.ndarray) -> np.ndarray:
        """(N,) bool: whether flights with ways (N, S, 3) m go over the net, where there is one."""
        net = self.scene.net
        return np.ones(len(ways), bool) if net is None else clears_net(ways, self.ball.radius, net)

    def flown(
        self, number: int, start: np.ndarray, target: np.ndarray, seconds: np.ndarray
    ) -> tuple[Aimed, np.ndarray]:
        """The launches (S) of a pass from `start` (S, 3) m to `target` (3,) m that take `seconds` (S,), and whether
        each is what a human can give and clear of the net."""
        spin = spun(start, target, seconds, self.ball, self.sites[number].kind)
        aimed = aim(start, target, self.ball, seconds, self.passes[number].bounces, spin, fastest=self.fastest(number))
        clear = self.clear(ways_of(start, aimed.velocity, spin, seconds, self.ball))
        return aimed, aimed.possible & (aimed.miss <= ON_TARGET) & clear

    def ball_on(self, number: int, link: Link, normal: np.ndarray) -> np.ndarray:
        """(3,) m: the ball on the part of a strike toward `normal` (3,), world."""
        own = quaternion.rotate(quaternion.about_up(np.array([-link.facing])), normal[None])
        place = in_world(link.moment.ball(own, self.ball.radius), self.sites[number].place, np.array([link.facing]))[0]
        if number == 0 and self.scene.serve == GROUND:
            place[2] = self.ball.radius
        return place

    def serving_place(self, place: np.ndarray) -> np.ndarray:
        """(3,) m: from where the first ball comes to `place` (3,) m."""
        serve = self.scene.serve
        if isinstance(serve, tuple):
            return np.maximum(np.array(serve), [-np.inf, -np.inf, self.ball.radius])
        whence = self.whence(0)
        way = place[:2] - whence
        return np.array([*(whence + SERVED_FROM * way / max(np.linalg.norm(way), 1e-9)), SERVED_HEIGHT])

    def serving_seconds(self, place: np.ndarray) -> float:
        """How long the first ball flies to `place` (3,) m, on whole frames: a quiet throw, as high as a net needs."""
        start, fps = self.serving_place(place), self.scene.fps
        quiet = SERVED_SECONDS + SERVED_PER_METRE * float(np.linalg.norm(place[:2] - start[:2]))
        tried = np.ceil(np.linspace(quiet, max(LONGEST_SERVE, quiet), 8) * fps) / fps
        starts = np.tile(start, (len(tried), 1))
        aimed = aim(starts, place, self.ball, tried, 0)
        good = (aimed.miss <= ON_TARGET) & self.clear(ways_of(starts, aimed.velocity, None, tried, self.ball))
        return float(tried[np.argmax(good)])

    def _standing_by(self) -> list[list[tuple[str, np.ndarray]]]:
        places = {player.name: np.array(player.place, float) for player in self.scene.players}
        out = []
        for one in self.passes:
            out.append([(name, place) for name, place in places.items() if name not in (one.giver, one.receiver)])
            if one.at is not None:
                places[one.receiver] = np.array(one.at, float)
        return out


def turned(vectors: np.ndarray, angle: float) -> np.ndarray:
    """Vectors (N, 3) turned by `angle` rad about the vertical."""
    return quaternion.rotate(quaternion.about_up(np.array([angle])), vectors)
