"""What all steps of planning a passing scene share: who strikes where with what, what stands in a ball's way, where the
first ball comes from, and what makes one strike or flight better than another, all in m/s of changed velocity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..ball.aim import Aimed, aim
from ..ball.batch import after, launched
from ..ball.contact import Tool, in_world
from ..ball.physics import FASTEST, Ball, rolling_spin
from ..base.errors import Cancelled
from ..base.vectors import cross_level
from ..motion import quaternion
from .pass_scene import GROUND, Net, Pass, PassScene, served_by
from .strike_choice import StrikeMoments

ON_TARGET = 0.02
"""Metres beside its target with which a ball has come to it."""
SERVED_FROM, SERVED_HEIGHT = 0.4, 1.2
"""Metres before who serves, and above the ground, from where the ball comes in."""
SERVED_SECONDS, SERVED_PER_METRE, LONGEST_SERVE = 0.5, 0.07, 3.0
"""How long it flies, how much longer for each metre, and at most."""
TIMES = np.linspace(0.1, 2.5, 25)
"""Seconds after a strike at which natural ways are looked at."""
SPEEDS = {"toss": (4.5, 8.0), "pass": (5.0, 12.0), "attack": (9.0, 25.0)}
"""m/s between which a ball of each kind sets out, by its name."""
SPINS = {"toss": -0.1, "pass": -0.1, "attack": 0.2}
"""Shares of the spin with which a ball rolls at its speed: struck from below it turns back, struck hard it turns
forward."""
LONG = {"toss": 1.5, "pass": 1.5, "attack": 0.9}
PER_SECOND = 2.0
"""Seconds of travel beyond which a ball of each kind takes long, and what each more costs."""
RISES = {"toss": (0.7, 0.95), "pass": (0.4, 0.8), "attack": (-0.4, 0.3)}
"""Sines of the angles over the ground between which a ball of each kind sets out."""
BEHIND, PER_RADIAN = np.radians(100.0), 2.0
"""Radians from where a body faces beyond which it does not see a ball come, and what each more costs."""
MOST_MISS, PER_TRAVEL = 4.0, 0.8
IN_THE_WAY, PERSON, TALL = 6.0, 0.45, 1.9
"""What it costs to fly through the middle of somebody, his radius with room around him and his height in m."""
THROUGH = 0.35 * IN_THE_WAY
"""What it costs at least where a ball meets the body itself."""
PUSHED = 2.0
"""What it costs that a ball is pushed across the way of the part; the opposite way twice as much."""
RISES_STILL, PER_RISE = 1.0, 0.5
"""m/s upward with which a ball may still come in, and what each more costs: it has bounced a moment ago."""
OWN_BODY, TRUNK, TRUNK_FROM = 8.0, 0.22, 0.8
"""What it costs to go through the middle of a trunk, its radius and lower end in m."""
TRUNK_TO = {"head": 1.35, "chest": 0.0}
UPRIGHT = 1.7
"""Metres up to which a ball stays clear of the body of who strikes it, by what he strikes with, else UPRIGHT."""
A_MOMENT = 1e-3  # s before a ball arrives at which its speed is read
_STEPS = 30  # pieces into which a flight is cut


@dataclass(frozen=True, eq=False, kw_only=True)
class Site:
    """Where, with what and how one of the strikes is to be made.

    player: his name. place (2,) m; facing rad before it. kind: toss, pass, attack, or receive (the last one). part;
    tool. size: of the body against the library's. moments: what it can strike with. asked: the pass that goes out, None
    for the last strike."""

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


@dataclass(frozen=True, eq=False, kw_only=True)
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

    def flown(self, number: int, start: np.ndarray, target: np.ndarray,
              seconds: np.ndarray) -> tuple[Aimed, np.ndarray]:
        """The launches (S) of a pass from `start` (S, 3) m to `target` (3,) m that take `seconds` (S,), and whether
        each is what a human can give and clear of the net."""
        spin = spun(start, target, seconds, self.ball, self.sites[number].kind)
        aimed = aim(start, target, self.ball, seconds=seconds, bounces=self.passes[number].bounces, spin=spin,
                    fastest=self.fastest(number))
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


def cost_of_moments(moments: StrikeMoments, facing: np.ndarray, whence: np.ndarray) -> np.ndarray:
    """(N,): what speaks against the moments beside their ball's way: a ball that comes from behind a body that faces
    `facing` (N,) rad, `whence` (2,) m: the way to where it comes from; a hit motion that travels."""
    comes = np.arctan2(whence[1], whence[0])
    aside = np.abs((comes - facing + np.pi) % (2.0 * np.pi) - np.pi)
    return PER_RADIAN * np.maximum(aside - BEHIND, 0.0) + PER_TRAVEL * moments.travel


def misses(ways: np.ndarray, speeds: np.ndarray, toward: np.ndarray, bounces: int) -> np.ndarray:
    """(N,): by how many metres natural ways (N, T, 3) with velocities (N, T, 3) pass `toward` (3,) after so many
    bounces, MOST_MISS at most."""
    up = speeds[..., 2] > 0.0
    bounced = np.cumsum(up[:, 1:] & ~up[:, :-1], axis=1)
    counted = np.concatenate([np.zeros((len(ways), 1), int), bounced], axis=1)
    far = np.linalg.norm(ways - toward, axis=2) + np.where(counted == bounces, 0.0, 1.0)
    return np.minimum(far.min(axis=1), MOST_MISS)


def wished(velocities: np.ndarray, kind: str) -> np.ndarray:
    """Natural velocities (N, 3) m/s, as fast and as steep as the kind wants."""
    speed = np.linalg.norm(velocities, axis=1)
    level = np.linalg.norm(velocities[:, :2], axis=1)
    rise = np.clip(velocities[:, 2] / np.maximum(speed, 1e-9), *RISES[kind])
    ahead = np.sqrt(1.0 - rise**2) / np.maximum(level, 1e-9)
    way = np.concatenate([velocities[:, :2] * ahead[:, None], rise[:, None]], axis=1)
    return way * np.clip(speed, *SPEEDS[kind])[:, None]


def spun(starts: np.ndarray, target: np.ndarray, seconds: np.ndarray, ball: Ball, kind: str) -> np.ndarray:
    """(N, 3) rad/s: the spin of balls of a kind that are to go from `starts` (N, 3) m to `target` ((N,) 3) m."""
    return SPINS[kind] * rolling_spin((target - starts) / np.asarray(seconds)[:, None], ball)


def ways_of(starts: np.ndarray, velocities: np.ndarray, spin: np.ndarray | None, seconds: np.ndarray,
            ball: Ball) -> np.ndarray:
    """(N, _STEPS + 1, 3) m: flights of N balls, each at even steps of its own `seconds` (N,)."""
    balls = launched(starts, velocities, spin, ball)
    out = [balls.position]
    for _ in range(_STEPS):
        balls = after(balls, ball, seconds / _STEPS)
        out.append(balls.position)
    return np.stack(out, axis=1)


def out_of_the_way(ways: np.ndarray, others: np.ndarray) -> np.ndarray:
    """(N, P): what it costs to fly through who stands at `others` (P, 2) m; ways (N, S, 3) m."""
    if not len(others):
        return np.zeros((len(ways), 0))
    a, b = ways[:, :-1, None, :2], ways[:, 1:, None, :2]
    share = np.sum((others - a) * (b - a), axis=-1) / np.maximum(np.sum((b - a) ** 2, axis=-1), 1e-9)
    near = np.linalg.norm(others - a - np.clip(share, 0.0, 1.0)[..., None] * (b - a), axis=-1)
    low = np.minimum(ways[:, :-1, 2], ways[:, 1:, 2])[..., None] < TALL
    inside = np.where(low, np.maximum(PERSON - near, 0.0) / PERSON, 0.0)
    return IN_THE_WAY * inside.max(axis=1)


def through_body(ways: np.ndarray, radius: float, place: np.ndarray, tall: float) -> np.ndarray:
    """(N,): what it costs that balls of `radius` m on their ways (N, S, 3) m go through the trunk, up to `tall` m, of
    who gives or receives them, at `place` (2,) m."""
    near = np.linalg.norm(ways[..., :2] - place, axis=-1) - radius
    inside = (ways[..., 2] > TRUNK_FROM) & (ways[..., 2] < tall + radius)
    return OWN_BODY * np.where(inside, np.clip((TRUNK - near) / TRUNK, 0.0, 1.0), 0.0).max(axis=1)


def arrivals(starts: np.ndarray, velocities: np.ndarray, spin: np.ndarray | None, seconds: np.ndarray,
             ball: Ball) -> np.ndarray:
    """(N, 3) m/s: velocities with which balls come in after `seconds` (N,); one that is met on the ground has not
    bounced."""
    return after(launched(starts, velocities, spin, ball), ball, seconds - A_MOMENT).velocity


def against_the_part(arriving: np.ndarray, leaving: np.ndarray, part: np.ndarray) -> np.ndarray:
    """(N,): what it costs that balls which come in with `arriving` (N, 3) m/s and leave with `leaving` (3,) are not
    pushed the way that the part moves, `part` (3,) m/s."""
    push = leaving - arriving
    along = push @ part / np.maximum(np.linalg.norm(push, axis=1) * np.linalg.norm(part), 1e-9)
    return PUSHED * (1.0 - along)


def lasting(seconds: np.ndarray, kind: str) -> np.ndarray:
    """(N,): what it costs that balls travel for `seconds` (N,)."""
    return PER_SECOND * np.maximum(seconds - LONG[kind], 0.0)


def rising(arriving: np.ndarray) -> np.ndarray:
    """(N,): what it costs that balls come in with `arriving` (N, 3) m/s right from their bounce."""
    return PER_RISE * np.maximum(arriving[:, 2] - RISES_STILL, 0.0)


def clears_net(ways: np.ndarray, radius: float, net: Net) -> np.ndarray:
    """(N,) bool: whether balls of `radius` m on their ways (N, S, 3) m go over the net wherever they cross it."""
    start, end = np.array(net.start), np.array(net.end)
    along = end - start
    aside = cross_level(along, ways[..., :2] - start) / np.linalg.norm(along)
    crosses = (aside[:, :-1] > 0.0) != (aside[:, 1:] > 0.0)
    share = aside[:, :-1] / np.where(crosses, aside[:, :-1] - aside[:, 1:], 1.0)
    at = ways[:, :-1] + np.clip(share, 0.0, 1.0)[..., None] * (ways[:, 1:] - ways[:, :-1])
    on = ((at[..., :2] - start) @ along) / (along @ along)
    width = radius / np.linalg.norm(along)
    hit = crosses & (on > -width) & (on < 1.0 + width) & (at[..., 2] < net.height + radius)
    return ~hit.any(axis=1)
