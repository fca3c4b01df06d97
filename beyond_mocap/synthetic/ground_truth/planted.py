"""A synthetic match in which every touch is known, for tests, figures, and to evaluate what a solver finds in a feed.

Twenty-two players wander about their places in two formations. A player has the ball, dribbles or not, and plays it to
a team-mate, along the ground or through the air; the ball follows `ball.flight`. The player who takes it comes to where
the ball is, with an opponent nearby. Opponents take some balls; some go out and are thrown in. `sample_feed` turns the
match into what a feed delivers: samples with noise, filled stretches, and balls put to a player.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...ball.flight import Flight, Launch, fly
from ...ball.physics import FOOTBALL, Ball, rolling_spin

LENGTH, WIDTH = 105.0, 68.0
TEAMS = ("home", "away")
_ROWS = ((-47.0, (0.0,)), (-30.0, (-22.0, -8.0, 8.0, 22.0)), (-12.0, (-24.0, -8.0, 8.0, 24.0)), (4.0, (-10.0, 10.0)))
_HIGH, _CHEST, _LOW = 1.35, 0.75, 2.45  # m of the ball's centre: head above, chest above, most
_HOLD = 9.0  # s over which a player leaves their place for a ball and returns
_SLOW = 0.4  # s, correlation time of the ball's error
_PLAYERS_SLOW, _PLAYERS_NOISE, _JITTER = 2.0, 0.08, 0.01  # s, m; m from sample to sample


@dataclass(frozen=True, eq=False, kw_only=True)
class PlantedTouch:
    """A touch that changes the ball's trajectory.

    Attributes:
        time: s.
        player: id.
        part: "foot", "chest", "head" or "hand".
        label: "kick", "receive", "dribble", "header" or "throw-in".
        position: (3,) m, the ball's centre.
        before: (3,) m/s, the ball's velocity before the touch.
        after: (3,) m/s, its velocity after the touch.
    """

    time: float
    player: str
    part: str
    word: str
    position: np.ndarray
    before: np.ndarray
    after: np.ndarray


@dataclass(eq=False)
class PlantedMatch:
    """Ground truth of a match.

    Attributes:
        seconds: length of the match.
        ids: of the P players, one team after the other.
        ball: the ball.
        touches: in order of time.
        flights: the ball's flight after each touch until the next.
        outs: (time, line) where the ball left the pitch, line "touch" or "goal".
        held: (from, until, place (3,)) where a player holds it for a throw-in.
        places: places of the players.
    """

    seconds: float
    ids: tuple[str, ...]
    ball: Ball = FOOTBALL
    touches: list[PlantedTouch] = field(default_factory=list)
    flights: list[Flight] = field(default_factory=list)
    outs: list[tuple[float, str]] = field(default_factory=list)
    held: list[tuple[float, float, np.ndarray]] = field(default_factory=list)
    places: "_Places" = None

    def ball_at(self, times: np.ndarray) -> np.ndarray:
        """Compute the ball's centre (N, 3) m at `times` (N,) s."""
        starts = np.array([touch.time for touch in self.touches])
        which = np.maximum(np.searchsorted(starts, times, side="right") - 1, 0)
        out = np.empty((len(times), 3))
        for i in np.unique(which):
            out[which == i] = self.flights[i].at(np.asarray(times)[which == i])
        for start, end, place in self.held:
            out[(times >= start) & (times < end)] = place
        return out

    def players_at(self, times: np.ndarray) -> np.ndarray:
        """Compute the players' places (P, N, 2) m at `times` (N,) s."""
        return np.stack([self.places.at(player, np.asarray(times, float)) for player in range(len(self.ids))])

    @property
    def bounces(self) -> np.ndarray:
        """Times (K,) s at which the ball bounced on the ground."""
        ends = [*(touch.time for touch in self.touches[1:]), self.seconds]
        found = [flight.bounces[flight.bounces < end] for flight, end in zip(self.flights, ends)]
        return np.concatenate(found) if found else np.zeros(0)


def planted_match(seconds: float = 120.0, seed: int = 0) -> PlantedMatch:
    """Build a match of `seconds`; the same seed gives the same match."""
    return _Play(seconds, seed).whole()


class _Places:
    """Places of all players: a slow wander about each home place, and the balls that they go to."""

    def __init__(self, rng: np.random.Generator):
        rows = [(x, y) for x, ys in _ROWS for y in ys]
        self.home = np.array([*rows, *((-x, -y) for x, y in rows)])
        self.period = rng.uniform(9.0, 21.0, (len(self.home), 2))
        self.phase = rng.uniform(0.0, 2.0 * np.pi, (len(self.home), 2))
        self.wide = rng.uniform(1.5, 5.0, (len(self.home), 2)) * np.where(np.abs(self.home[:, :1]) > 40.0, 0.4, 1.0)
        self.drawn: list[list[tuple[float, np.ndarray]]] = [[] for _ in self.home]
        self.ways: dict[int, Callable[[np.ndarray], np.ndarray]] = {}

    def wander(self, player: int, times: np.ndarray) -> np.ndarray:
        """Compute the places (N, 2) m of a player without any ball."""
        angle = 2.0 * np.pi * times[:, None] / self.period[player] + self.phase[player]
        return self.home[player] + self.wide[player] * np.sin(angle)

    def send(self, player: int, time: float, place: np.ndarray) -> None:
        """Make a player be at `place` (2,) at `time`; times of one player only grow."""
        self.drawn[player].append((time, place - self.wander(player, np.array([time]))[0]))
        self.ways.pop(player, None)

    def stay(self, player: int, since: float) -> None:
        """Let a player have been at their last place since `since`."""
        time, away = self.drawn[player][-1]
        wandered = self.wander(player, np.array([time, since]))
        earlier = [one for one in self.drawn[player][:-1] if one[0] < since]
        self.ways.pop(player, None)
        self.drawn[player] = [*earlier, (since, away + wandered[0] - wandered[1]), (time, away)]

    def at(self, player: int, times: np.ndarray) -> np.ndarray:
        """Compute the places (N, 2) m of a player."""
        if player not in self.ways:
            self.ways[player] = self._away(player)
        return self.wander(player, times) + self.ways[player](times)

    def _away(self, player: int) -> Callable[[np.ndarray], np.ndarray]:
        """Build the offset in m from a player's wander: smoothly through all places they go to, and back where there is
        time.
        """
        from scipy.interpolate import PchipInterpolator

        knots: list[tuple[float, np.ndarray]] = [(-_HOLD, np.zeros(2))]
        for time, away in self.drawn[player]:
            if time - knots[-1][0] > 2.0 * _HOLD:
                knots += [(knots[-1][0] + _HOLD, np.zeros(2)), (time - _HOLD, np.zeros(2))]
            knots.append((time, away))
        knots.append((knots[-1][0] + _HOLD, np.zeros(2)))
        when, where = np.array([time for time, _ in knots]), np.array([away for _, away in knots])
        smooth = PchipInterpolator(when, where)
        return lambda times: smooth(np.clip(times, when[0], when[-1]))

    def ready(self, player: int, time: float, place: np.ndarray) -> bool:
        """Whether a player can be at `place` at `time` at a human running speed."""
        last = self.drawn[player][-1][0] if self.drawn[player] else -_HOLD
        here = self.at(player, np.array([min(last, time) if time - last < _HOLD else time]))[0]
        left = max(time - last, 0.05) if time - last < _HOLD else _HOLD
        return bool(np.linalg.norm(place - here) < 4.5 * left)


class _Play:
    """Builds a match, touch by touch."""

    def __init__(self, seconds: float, seed: int):
        self.rng = np.random.default_rng(seed)
        self.places = _Places(self.rng)
        ids = tuple(f"{team}_{number}" for team in TEAMS for number in range(1, 12))
        self.match = PlantedMatch(seconds, ids, places=self.places)
        self.holder, self.time = 10, 1.0
        self.position, self.before = np.array([0.0, 0.0, FOOTBALL.radius]), np.zeros(3)

    def whole(self) -> PlantedMatch:
        self._meet("kick", "foot")
        while self.time < self.match.seconds:
            self._pass()
            for _ in range(self.rng.choice(4, p=(0.3, 0.3, 0.25, 0.15)) if self.position[2] < 0.5 else 0):
                self._drive()
        return self.match

    def _meet(self, word: str, part: str) -> None:
        """Move the holder to the ball."""
        self.word, self.part = word, part
        reach = self.rng.uniform(0.1, 0.3) if part in ("head", "chest") else self.rng.uniform(0.2, 0.6)
        angle = self.rng.uniform(0.0, 2.0 * np.pi)
        place = self.position[:2] + reach * np.array([np.cos(angle), np.sin(angle)])
        self.places.send(self.holder, self.time, place)
        if self.rng.random() < 0.4:
            self._press(place)

    def _press(self, place: np.ndarray) -> None:
        """Move an opponent near."""
        others = [p for p in range(22) if p // 11 != self.holder // 11 and self._free(p)]
        away = [np.linalg.norm(self.places.at(p, np.array([self.time]))[0] - place) for p in others]
        if others and min(away) < 12.0:
            angle = self.rng.uniform(0.0, 2.0 * np.pi)
            beside = place + self.rng.uniform(0.9, 2.5) * np.array([np.cos(angle), np.sin(angle)])
            if self.places.ready(others[int(np.argmin(away))], self.time, beside):
                self.places.send(others[int(np.argmin(away))], self.time, beside)

    def _free(self, player: int) -> bool:
        return not self.places.drawn[player] or self.places.drawn[player][-1][0] < self.time - 1.0

    def _flight(self, velocity: np.ndarray, spin: np.ndarray, seconds: float) -> Flight:
        return fly(Launch(self.time, self.position, velocity, spin), self.match.ball, seconds)

    def _play(self, flight: Flight, time: float) -> None:
        """Add the touch: the ball leaves, and continues until `time`."""
        velocity, who = np.array(flight.launch.velocity), self.match.ids[self.holder]
        self.match.touches.append(
            PlantedTouch(time=self.time, player=who, part=self.part, word=self.word, position=self.position.copy(),
                         before=self.before.copy(), after=velocity)
        )
        self.match.flights.append(flight)
        self.time = time
        self.position, self.before = flight.at([time])[0], flight.velocity([time])[0]

    def _along(self, speed: float, angle: float) -> Flight:
        """Simulate a ball along the ground with a share of its rolling spin."""
        velocity = speed * np.array([np.cos(angle), np.sin(angle), 0.0])
        return self._flight(velocity, self.rng.uniform(0.2, 1.0) * rolling_spin(velocity, self.match.ball), 4.0)

    def _drive(self) -> None:
        """Add one more touch by the holder: the ball rolls on, and they run after it."""
        angle = self.rng.uniform(-0.8, 0.8) + np.arctan2(*-self.position[1::-1])
        self.word = "dribble" if self.word == "kick" else self.word
        self._play(self._along(self.rng.uniform(2.0, 6.5), angle), self.time + self.rng.uniform(0.45, 1.4))
        self._meet("dribble", "foot")

    def _pass(self) -> None:
        """Play the ball to another player: the first of some tries that a player can meet."""
        others = np.array([p for p in range(22) if p != self.holder])
        here = np.array([self.places.at(p, np.array([self.time + 1.0]))[0] for p in others])
        away = np.linalg.norm(here - self.position[:2], axis=1)
        share = np.exp(-away / 15.0) * np.where(others // 11 == self.holder // 11, 1.0, 0.12) * (away > 4.0) + 1e-9
        goes_out = self.rng.random() < 0.03
        for i in self.rng.choice(len(others), 0 if goes_out else 25, p=share / share.sum()):
            meets = self._tried(int(others[i]), here[i] - self.position[:2]) if self._free(others[i]) else None
            if meets is not None:
                self.word = "kick" if self.word == "dribble" else self.word
                self._play(*meets)
                return self._arrive(int(others[i]))
        return self._out()

    def _tried(self, other: int, way: np.ndarray) -> tuple[Flight, float] | None:
        """Try a ball played `to_target` (2,) m to `other`; the flight and when they can take it, or None."""
        far, angle = float(np.linalg.norm(way)), np.arctan2(way[1], way[0])
        across = way / far
        if self.rng.random() < min(0.25 + far / 60.0, 0.8):
            rise = np.radians(self.rng.uniform(15.0, 45.0))
            speed = np.sqrt(far * 9.8 / (0.8 * np.sin(2.0 * rise))) * self.rng.uniform(0.9, 1.25)
            speed = min(speed, 15.0) if self.part == "head" else speed
            velocity = speed * np.array([*(np.cos(rise) * across), np.sin(rise)])
            flight = self._flight(velocity, np.array([0.0, 0.0, self.rng.normal(0.0, 25.0)]), 4.0)
        else:
            most = 12.0 if self.part == "head" else 24.0
            flight = self._along(min(np.sqrt(self.rng.uniform(3.0, 11.0) ** 2 + 3.5 * far), most), angle)
        times = np.arange(self.time + 0.35, self.time + 4.0, 0.02)
        path = flight.at(times)
        fits = (path[:, 2] < _LOW) & (np.abs(path[:, 0]) < LENGTH / 2) & (np.abs(path[:, 1]) < WIDTH / 2)
        near = np.flatnonzero(fits & (np.abs((path[:, :2] - self.position[:2]) @ across - far) < 3.0))
        for i in self.rng.permutation(near)[:3]:
            if self.places.ready(other, times[i], path[i, :2]):
                return flight, float(times[i])
        return None

    def _arrive(self, other: int) -> None:
        """Let `other` take the ball: they stop it, or play on at once."""
        self.holder = other
        height = self.position[2]
        part = "head" if height > _HIGH else "chest" if height > _CHEST else "foot"
        at_once = part == "head" or self.rng.random() < 0.25
        self._meet("header" if part == "head" else "kick" if at_once else "receive", part)
        if not at_once:
            angle, speed = self.rng.uniform(0.0, 2.0 * np.pi), self.rng.uniform(0.5, 4.0)
            velocity = np.array([speed * np.cos(angle), speed * np.sin(angle), -0.1])
            self._play(self._flight(velocity, np.zeros(3), 4.0), self.time + self.rng.uniform(0.6, 1.6))
            self._meet("kick", "foot")

    def _out(self) -> None:
        """Play the ball over the touch line, followed by a throw-in."""
        side = 1.0 if self.position[1] >= 0.0 else -1.0
        left = WIDTH / 2 + 2.0 - side * self.position[1]
        flight = self._flight(np.array([2.0, side * (12.0 + 0.3 * left), 3.0]), np.zeros(3), 12.0)
        times = np.arange(self.time, self.time + 12.0, 0.01)
        beyond = np.flatnonzero(np.abs(flight.at(times)[:, 1]) > WIDTH / 2)
        if len(beyond):
            self.match.outs.append((float(times[beyond[0]]), "touch"))
        self._play(flight, self.time + 12.0)
        self.holder = self._nearest_opponent()
        self.position = np.array([np.clip(self.position[0], -50.0, 50.0), side * (WIDTH / 2 + 0.2), 2.0])
        self.before = np.zeros(3)
        self.match.held.append((self.time - 3.0, self.time, self.position))
        self._meet("throw-in", "hand")
        self.places.stay(self.holder, self.time - 3.0)

    def _nearest_opponent(self) -> int:
        others = [p for p in range(22) if p // 11 != self.holder // 11]
        here = [np.linalg.norm(self.places.at(p, np.array([self.time]))[0] - self.position[:2]) for p in others]
        return others[int(np.argmin(here))]


@dataclass(frozen=True, eq=False, kw_only=True)
class Feed:
    """N samples of a feed.

    Attributes:
        times: (N,) s.
        ball: (N, 3) m, z NaN if there are no heights.
        positions: (P, N, 2) m of the players.
        ids: of the players.
        teams: of the players.
        filled: (N,) bool, samples on straight lines at constant velocity.
        wrong: (N,) bool, samples put elsewhere.
        fps: Hz.
        length: of the pitch, m.
        width: of the pitch, m.
    """

    times: np.ndarray
    ball: np.ndarray
    positions: np.ndarray
    ids: tuple[str, ...]
    teams: tuple[str, ...]
    filled: np.ndarray
    wrong: np.ndarray
    fps: float
    length: float = LENGTH
    width: float = WIDTH


def sample_feed(
    match: PlantedMatch, fps: float = 25.0, noise: float = 0.08, heights: bool = True, filled: float = 0.0,
    snaps: float = 0.1, seed: int = 0,
) -> Feed:  # fmt: skip
    """Sample a match as a feed.

    Args:
        match: the match.
        fps: Hz.
        noise: m, standard deviation of each of the ball's coordinates, half of it from sample to sample.
        heights: whether the ball has heights.
        filled: share of samples that are replaced by straight lines between the touches.
        snaps: share of touches at which the ball is put to the player for a fifth of a second.
        seed: of the errors.
    Returns:
        The feed.
    """
    rng = np.random.default_rng(seed)
    times = np.arange(int(match.seconds * fps)) / fps
    ball = match.ball_at(times) - np.array([0.0, 0.0, match.ball.radius])
    players = match.players_at(times)
    measured = ball + _slow_noise(rng, ball.shape, _SLOW * fps, 0.87 * noise) + rng.normal(0.0, 0.5 * noise, ball.shape)
    wrong = _snapped(match, times, measured, players=players, share=snaps, rng=rng)
    made = _filled(match, times, measured, ball=ball, share=filled, rng=rng)
    measured[:, 2] = np.maximum(measured[:, 2], 0.0) if heights else np.nan
    seen = players + _slow_noise(rng, players.shape, _PLAYERS_SLOW * fps, _PLAYERS_NOISE, axis=1)
    seen += rng.normal(0.0, _JITTER, seen.shape)
    teams = tuple(TEAMS[i // 11] for i in range(len(match.ids)))
    return Feed(times=times, ball=measured.round(2), positions=seen.round(2), ids=match.ids, teams=teams, filled=made,
                wrong=wrong & ~made, fps=fps)


def _slow_noise(rng, shape, samples: float, size: float, axis: int = 0) -> np.ndarray:
    """Build noise of standard deviation `size` that is correlated over `samples` along an axis."""
    from scipy.signal import lfilter

    keep = np.exp(-1.0 / samples)
    white = rng.normal(0.0, size, shape)
    first = np.take(white, [0], axis=axis) * keep
    return lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white, axis=axis, zi=first)[0]


def _snapped(match, times, measured, players, share: float, rng) -> np.ndarray:
    """Put the ball to the player at some touches, in place; returns (N,) bool where."""
    wrong = np.zeros(len(times), bool)
    for touch in match.touches:
        if rng.random() < share:
            near = np.abs(times - touch.time) < 0.1
            measured[near] = np.column_stack([players[match.ids.index(touch.player), near], np.zeros(near.sum())])
            wrong |= near
    return wrong


def _filled(match, times, measured, ball, share: float, rng) -> np.ndarray:
    """Replace some stretches by straight lines between the touches, in place; returns (N,) bool where."""
    made = np.zeros(len(times), bool)
    touches = np.array([touch.time for touch in match.touches])
    while made.mean() < share:
        start = rng.uniform(0.0, match.seconds)
        first, last = np.searchsorted(times, [start, min(start + rng.uniform(1.0, 6.0), times[-1])])
        if last - first < 3:
            continue
        inside = np.searchsorted(times, touches[(touches > times[first]) & (touches < times[last])])
        corners = np.unique([first, *inside, last])
        for axis in range(3):
            measured[first : last + 1, axis] = np.interp(times[first : last + 1], times[corners], ball[corners, axis])
        made[first : last + 1] = True
    return made
