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

from ...ball.flight import Flight, Launch, simulate_flight
from ...ball.physics import FOOTBALL, Ball, compute_rolling_spin

LENGTH, WIDTH = 105.0, 68.0
TEAMS = ("home", "away")
_ROWS = ((-47.0, (0.0,)), (-30.0, (-22.0, -8.0, 8.0, 22.0)), (-12.0, (-24.0, -8.0, 8.0, 24.0)), (4.0, (-10.0, 10.0)))
_HIGH, _CHEST, _LOW = 1.35, 0.75, 2.45  # m of the ball's centre: head above, chest above, most
_HOLD = 9.0  # s over which a player leaves their place for a ball and returns
_SLOW = 0.4  # s, correlation time of the ball's error
_PLAYERS_SLOW, _PLAYERS_NOISE, _JITTER = 2.0, 0.08, 0.01  # s, m; m from sample to sample


@dataclass(frozen=True, eq=False, kw_only=True)
class SyntheticTouch:
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
    label: str
    position: np.ndarray
    before: np.ndarray
    after: np.ndarray


@dataclass(eq=False)
class SyntheticMatch:
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
    touches: list[SyntheticTouch] = field(default_factory=list)
    flights: list[Flight] = field(default_factory=list)
    outs: list[tuple[float, str]] = field(default_factory=list)
    held: list[tuple[float, float, np.ndarray]] = field(default_factory=list)
    places: "_PlayerPlaces" = None

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
        return np.stack([self.places.places_at(player, np.asarray(times, float)) for player in range(len(self.ids))])


def build_match(seconds: float = 120.0, seed: int = 0) -> SyntheticMatch:
    """Build a match of `seconds`; the same seed gives the same match."""
    return _MatchBuilder(seconds, seed).build_match()


class _PlayerPlaces:
    """Places of all players: a slow wander about each home place, and the balls that they go to."""

    def __init__(self, rng: np.random.Generator):
        rows = [(x, y) for x, ys in _ROWS for y in ys]
        self.home = np.array([*rows, *((-x, -y) for x, y in rows)])
        self.period = rng.uniform(9.0, 21.0, (len(self.home), 2))
        self.phase = rng.uniform(0.0, 2.0 * np.pi, (len(self.home), 2))
        self.amplitude = rng.uniform(1.5, 5.0, (len(self.home), 2)) * np.where(np.abs(self.home[:, :1]) > 40.0, 0.4,
                                                                               1.0)
        self.visits: list[list[tuple[float, np.ndarray]]] = [[] for _ in self.home]
        self.offsets: dict[int, Callable[[np.ndarray], np.ndarray]] = {}

    def compute_wander(self, player: int, times: np.ndarray) -> np.ndarray:
        """Compute the places (N, 2) m of a player without any ball."""
        angle = 2.0 * np.pi * times[:, None] / self.period[player] + self.phase[player]
        return self.home[player] + self.amplitude[player] * np.sin(angle)

    def send_player(self, player: int, time: float, place: np.ndarray) -> None:
        """Make a player be at `place` (2,) at `time`; times of one player only grow."""
        self.visits[player].append((time, place - self.compute_wander(player, np.array([time]))[0]))
        self.offsets.pop(player, None)

    def keep_in_place(self, player: int, since: float) -> None:
        """Let a player have been at their last place since `since`."""
        time, away = self.visits[player][-1]
        wandered = self.compute_wander(player, np.array([time, since]))
        earlier = [one for one in self.visits[player][:-1] if one[0] < since]
        self.offsets.pop(player, None)
        self.visits[player] = [*earlier, (since, away + wandered[0] - wandered[1]), (time, away)]

    def places_at(self, player: int, times: np.ndarray) -> np.ndarray:
        """Compute the places (N, 2) m of a player."""
        if player not in self.offsets:
            self.offsets[player] = self._build_offset(player)
        return self.compute_wander(player, times) + self.offsets[player](times)

    def _build_offset(self, player: int) -> Callable[[np.ndarray], np.ndarray]:
        """Build the offset in m from a player's wander: smoothly through all places they go to, and back where there is
        time.
        """
        from scipy.interpolate import PchipInterpolator

        knots: list[tuple[float, np.ndarray]] = [(-_HOLD, np.zeros(2))]
        for time, away in self.visits[player]:
            if time - knots[-1][0] > 2.0 * _HOLD:
                knots += [(knots[-1][0] + _HOLD, np.zeros(2)), (time - _HOLD, np.zeros(2))]
            knots.append((time, away))
        knots.append((knots[-1][0] + _HOLD, np.zeros(2)))
        when, where = np.array([time for time, _ in knots]), np.array([away for _, away in knots])
        smooth = PchipInterpolator(when, where)
        return lambda times: smooth(np.clip(times, when[0], when[-1]))

    def can_reach(self, player: int, time: float, place: np.ndarray) -> bool:
        """Whether a player can be at `place` at `time` at a human running speed."""
        last = self.visits[player][-1][0] if self.visits[player] else -_HOLD
        here = self.places_at(player, np.array([min(last, time) if time - last < _HOLD else time]))[0]
        time_left = max(time - last, 0.05) if time - last < _HOLD else _HOLD
        return bool(np.linalg.norm(place - here) < 4.5 * time_left)


class _MatchBuilder:
    """Builds a match, touch by touch."""

    def __init__(self, seconds: float, seed: int):
        self.rng = np.random.default_rng(seed)
        self.places = _PlayerPlaces(self.rng)
        ids = tuple(f"{team}_{number}" for team in TEAMS for number in range(1, 12))
        self.match = SyntheticMatch(seconds, ids, places=self.places)
        self.holder, self.time = 10, 1.0
        self.position, self.before = np.array([0.0, 0.0, FOOTBALL.radius]), np.zeros(3)

    def build_match(self) -> SyntheticMatch:
        """Build touches until the match is over."""
        self._meet_ball("kick", "foot")
        while self.time < self.match.seconds:
            self._pass_ball()
            for _ in range(self.rng.choice(4, p=(0.3, 0.3, 0.25, 0.15)) if self.position[2] < 0.5 else 0):
                self._dribble_on()
        return self.match

    def _meet_ball(self, label: str, part: str) -> None:
        """Move the holder to the ball."""
        self.word, self.part = label, part
        reach = self.rng.uniform(0.1, 0.3) if part in ("head", "chest") else self.rng.uniform(0.2, 0.6)
        angle = self.rng.uniform(0.0, 2.0 * np.pi)
        place = self.position[:2] + reach * np.array([np.cos(angle), np.sin(angle)])
        self.places.send_player(self.holder, self.time, place)
        if self.rng.random() < 0.4:
            self._add_opponent(place)

    def _add_opponent(self, place: np.ndarray) -> None:
        """Move an opponent near."""
        others = [p for p in range(22) if p // 11 != self.holder // 11 and self._is_free(p)]
        away = [np.linalg.norm(self.places.places_at(p, np.array([self.time]))[0] - place) for p in others]
        if others and min(away) < 12.0:
            angle = self.rng.uniform(0.0, 2.0 * np.pi)
            beside = place + self.rng.uniform(0.9, 2.5) * np.array([np.cos(angle), np.sin(angle)])
            if self.places.can_reach(others[int(np.argmin(away))], self.time, beside):
                self.places.send_player(others[int(np.argmin(away))], self.time, beside)

    def _is_free(self, player: int) -> bool:
        return not self.places.visits[player] or self.places.visits[player][-1][0] < self.time - 1.0

    def _simulate_flight(self, velocity: np.ndarray, spin: np.ndarray, seconds: float) -> Flight:
        return simulate_flight(Launch(self.time, self.position, velocity, spin), self.match.ball, seconds)

    def _add_touch(self, flight: Flight, time: float) -> None:
        """Add the touch: the ball leaves, and continues until `time`."""
        velocity, player_id = np.array(flight.launch.velocity), self.match.ids[self.holder]
        self.match.touches.append(
            SyntheticTouch(time=self.time, player=player_id, part=self.part, label=self.word,
                           position=self.position.copy(), before=self.before.copy(), after=velocity)
        )
        self.match.flights.append(flight)
        self.time = time
        self.position, self.before = flight.at([time])[0], flight.velocity([time])[0]

    def _roll_ball(self, speed: float, angle: float) -> Flight:
        """Simulate a ball along the ground with a share of its rolling spin."""
        velocity = speed * np.array([np.cos(angle), np.sin(angle), 0.0])
        return self._simulate_flight(velocity, self.rng.uniform(0.2, 1.0)
                                     * compute_rolling_spin(velocity, self.match.ball), 4.0)

    def _dribble_on(self) -> None:
        """Add one more touch by the holder: the ball rolls on, and they run after it."""
        angle = self.rng.uniform(-0.8, 0.8) + np.arctan2(*-self.position[1::-1])
        self.word = "dribble" if self.word == "kick" else self.word
        self._add_touch(self._roll_ball(self.rng.uniform(2.0, 6.5), angle), self.time + self.rng.uniform(0.45, 1.4))
        self._meet_ball("dribble", "foot")

    def _pass_ball(self) -> None:
        """Play the ball to another player: the first of some tries that a player can meet."""
        others = np.array([p for p in range(22) if p != self.holder])
        here = np.array([self.places.places_at(p, np.array([self.time + 1.0]))[0] for p in others])
        away = np.linalg.norm(here - self.position[:2], axis=1)
        share = np.exp(-away / 15.0) * np.where(others // 11 == self.holder // 11, 1.0, 0.12) * (away > 4.0) + 1e-9
        goes_out = self.rng.random() < 0.03
        for i in self.rng.choice(len(others), 0 if goes_out else 25, p=share / share.sum()):
            meets = self._try_pass(int(others[i]), here[i] - self.position[:2]) if self._is_free(others[i]) else None
            if meets is not None:
                self.word = "kick" if self.word == "dribble" else self.word
                self._add_touch(*meets)
                return self._receive_ball(int(others[i]))
        return self._play_out()

    def _try_pass(self, other: int, to_target: np.ndarray) -> tuple[Flight, float] | None:
        """Try a ball played `to_target` (2,) m to `other`; the flight and when they can take it, or None."""
        distance, angle = float(np.linalg.norm(to_target)), np.arctan2(to_target[1], to_target[0])
        across = to_target / distance
        if self.rng.random() < min(0.25 + distance / 60.0, 0.8):
            rise = np.radians(self.rng.uniform(15.0, 45.0))
            speed = np.sqrt(distance * 9.8 / (0.8 * np.sin(2.0 * rise))) * self.rng.uniform(0.9, 1.25)
            speed = min(speed, 15.0) if self.part == "head" else speed
            velocity = speed * np.array([*(np.cos(rise) * across), np.sin(rise)])
            flight = self._simulate_flight(velocity, np.array([0.0, 0.0, self.rng.normal(0.0, 25.0)]), 4.0)
        else:
            most = 12.0 if self.part == "head" else 24.0
            flight = self._roll_ball(min(np.sqrt(self.rng.uniform(3.0, 11.0) ** 2 + 3.5 * distance), most), angle)
        times = np.arange(self.time + 0.35, self.time + 4.0, 0.02)
        path = flight.at(times)
        fits = (path[:, 2] < _LOW) & (np.abs(path[:, 0]) < LENGTH / 2) & (np.abs(path[:, 1]) < WIDTH / 2)
        near = np.flatnonzero(fits & (np.abs((path[:, :2] - self.position[:2]) @ across - distance) < 3.0))
        for i in self.rng.permutation(near)[:3]:
            if self.places.can_reach(other, times[i], path[i, :2]):
                return flight, float(times[i])
        return None

    def _receive_ball(self, other: int) -> None:
        """Let `other` take the ball: they stop it, or play on at once."""
        self.holder = other
        height = self.position[2]
        part = "head" if height > _HIGH else "chest" if height > _CHEST else "foot"
        at_once = part == "head" or self.rng.random() < 0.25
        self._meet_ball("header" if part == "head" else "kick" if at_once else "receive", part)
        if not at_once:
            angle, speed = self.rng.uniform(0.0, 2.0 * np.pi), self.rng.uniform(0.5, 4.0)
            velocity = np.array([speed * np.cos(angle), speed * np.sin(angle), -0.1])
            self._add_touch(self._simulate_flight(velocity, np.zeros(3), 4.0), self.time + self.rng.uniform(0.6, 1.6))
            self._meet_ball("kick", "foot")

    def _play_out(self) -> None:
        """Play the ball over the touch line, followed by a throw-in."""
        side = 1.0 if self.position[1] >= 0.0 else -1.0
        distance = WIDTH / 2 + 2.0 - side * self.position[1]
        flight = self._simulate_flight(np.array([2.0, side * (12.0 + 0.3 * distance), 3.0]), np.zeros(3), 12.0)
        times = np.arange(self.time, self.time + 12.0, 0.01)
        beyond = np.flatnonzero(np.abs(flight.at(times)[:, 1]) > WIDTH / 2)
        if len(beyond):
            self.match.outs.append((float(times[beyond[0]]), "touch"))
        self._add_touch(flight, self.time + 12.0)
        self.holder = self._nearest_opponent()
        self.position = np.array([np.clip(self.position[0], -50.0, 50.0), side * (WIDTH / 2 + 0.2), 2.0])
        self.before = np.zeros(3)
        self.match.held.append((self.time - 3.0, self.time, self.position))
        self._meet_ball("throw-in", "hand")
        self.places.keep_in_place(self.holder, self.time - 3.0)

    def _nearest_opponent(self) -> int:
        others = [p for p in range(22) if p // 11 != self.holder // 11]
        here = [np.linalg.norm(self.places.places_at(p, np.array([self.time]))[0] - self.position[:2]) for p in others]
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
    match: SyntheticMatch, fps: float = 25.0, noise: float = 0.08, heights: bool = True, filled: float = 0.0,
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
    measured = ball + _build_slow_noise(rng, ball.shape, _SLOW * fps, 0.87 * noise) + rng.normal(0.0, 0.5 * noise,
            ball.shape)
    wrong = _snap_to_players(match, times, measured, players=players, share=snaps, rng=rng)
    is_filled = _fill_stretches(match, times, measured, ball=ball, share=filled, rng=rng)
    measured[:, 2] = np.maximum(measured[:, 2], 0.0) if heights else np.nan
    observed = players + _build_slow_noise(rng, players.shape, _PLAYERS_SLOW * fps, _PLAYERS_NOISE, axis=1)
    observed += rng.normal(0.0, _JITTER, observed.shape)
    teams = tuple(TEAMS[i // 11] for i in range(len(match.ids)))
    return Feed(times=times, ball=measured.round(2), positions=observed.round(2), ids=match.ids,
                teams=teams, filled=is_filled, wrong=wrong & ~is_filled, fps=fps)


def _build_slow_noise(rng, shape, samples: float, size: float, axis: int = 0) -> np.ndarray:
    """Build noise of standard deviation `size` that is correlated over `samples` along an axis."""
    from scipy.signal import lfilter

    correlation = np.exp(-1.0 / samples)
    white = rng.normal(0.0, size, shape)
    first = np.take(white, [0], axis=axis) * correlation
    return lfilter([np.sqrt(1.0 - correlation**2)], [1.0, -correlation], white, axis=axis, zi=first)[0]


def _snap_to_players(match, times, measured, players, share: float, rng) -> np.ndarray:
    """Put the ball to the player at some touches, in place; returns (N,) bool where."""
    wrong = np.zeros(len(times), bool)
    for touch in match.touches:
        if rng.random() < share:
            near = np.abs(times - touch.time) < 0.1
            measured[near] = np.column_stack([players[match.ids.index(touch.player), near], np.zeros(near.sum())])
            wrong |= near
    return wrong


def _fill_stretches(match, times, measured, ball, share: float, rng) -> np.ndarray:
    """Replace some stretches by straight lines between the touches, in place; returns (N,) bool where."""
    is_filled = np.zeros(len(times), bool)
    touches = np.array([touch.time for touch in match.touches])
    while is_filled.mean() < share:
        start = rng.uniform(0.0, match.seconds)
        first, last = np.searchsorted(times, [start, min(start + rng.uniform(1.0, 6.0), times[-1])])
        if last - first < 3:
            continue
        inside = np.searchsorted(times, touches[(touches > times[first]) & (touches < times[last])])
        corners = np.unique([first, *inside, last])
        for axis in range(3):
            measured[first : last + 1, axis] = np.interp(times[first : last + 1], times[corners], ball[corners, axis])
        is_filled[first : last + 1] = True
    return is_filled
