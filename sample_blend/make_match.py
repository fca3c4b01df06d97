"""Generate the small match: nine players, one ball, every touch known.

    python sample_blend/make_match.py [FOLDER]

Twenty-four seconds, four players a side; the away team changes a player halfway. The ball obeys `ball.flight`; the
player who touches it is there, on a smooth path. `small_Home.csv` and `small_Away.csv` are the tracking in Metrica's
form, `small.dat` and `small_meta.xml` the same in TRACAB's (which has heights and names), with the noise of a tracking
system; `small_events.csv` is a provider's list of events, whose clock is late by CLOCK_LATE seconds and which is
roughly timed; `small_touches.csv` is the ground truth. The same code gives the same bytes. Needs the core only.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
if __name__ == "__main__":
    sys.path[:0] = [str(HERE.parent), str(HERE)]

from make_sample import add_tracking_noise  # noqa: E402

from beyond_mocap.ball.aim import solve_launches  # noqa: E402
from beyond_mocap.ball.flight import Flight, Launch, simulate_flight  # noqa: E402
from beyond_mocap.ball.ground_launch import solve_ground_launches  # noqa: E402
from beyond_mocap.ball.physics import FOOTBALL  # noqa: E402

SECONDS, RATE = 24.0, 25.0  # s, and frames per second
LENGTH, WIDTH = 105.0, 68.0  # m, of the pitch
KICK_OFF = 1.0  # s, of the first touch
BESIDE = 0.38  # m from the middle of a player to the ball at a touch
CLOCK_LATE = 2.4  # s by which the events' clock is late
EVENTS_SCATTER = 0.12  # s, standard deviation of the events' times beside the touches

PLAYERS = {"home_1": "Ada Keeper", "home_4": "Ben Back", "home_7": "Cora Wing", "home_10": "Dan Striker",
           "away_1": "Eva Keeper", "away_5": "Finn Back", "away_6": "Gus Middle", "away_9": "Hana Forward",
           "away_14": "Ivo Fresh"}
PRESENT = {"away_9": (0.0, 9.0), "away_14": (11.0, SECONDS)}
"""Seconds in which players are on the pitch, for those who are not there all the time."""
PLACES = {
    "home_1": ((0, -47, 0), (12, -44, 1.5), (24, -47, 0.5)),
    "home_4": ((0, -20, -9), (9, -12, -6), (15, -6, 2), (24, -13, 6)),
    "home_7": ((0, 6, -13), (17, 28, -14), (24, 12, -9)),
    "home_10": ((0, -1, 1.5), (6, 18, 2), (16, 30, 3), (24, 14, 4)), "away_1": ((0, 48, 0), (8, 50, -1), (24, 47, 0)),
    "away_5": ((0, 24, 5), (7, 38, 0), (18, 30, 4), (24, 22, 3)), "away_6": ((0, 10, -6), (6, 20, -14), (24, 3, -3)),
    "away_9": ((0, 4, 4), (5, -4, 9), (9, -3, 31)), "away_14": ((11, -3, 33.5), (13.5, -4, 24), (24, -32, 3)),
}
"""Where each player is away from the ball: (s, x, y) m."""


@dataclass(frozen=True)
class Touch:
    """One touch.

    Attributes:
        player: id of the player.
        words: labels of the vocabulary.
        part: the part that meets the ball.
        target: (x, y) or (x, y, z) m of the ball's centre where it goes.
        seconds: s until it is there.
    """

    player: str
    words: str
    part: str
    target: tuple[float, ...]
    seconds: float


TOUCHES = (Touch("home_10", "kick right low inside", "foot", (-13, -8), 1.5),
           Touch("home_4", "receive right foot low", "foot", (-11.6, -7.6), 0.9),
           Touch("home_4", "kick right high top", "foot", (15, -17, 1.2), 1.9),
           Touch("home_7", "receive chest", "chest", (16.5, -17.4), 0.8),
           Touch("home_7", "dribble", "foot", (20.2, -18.2), 0.8),
           Touch("home_7", "dribble", "foot", (24.2, -18.8), 0.8), Touch("home_7", "dribble", "foot", (28.6, -19), 0.8),
           Touch("home_7", "kick right high inside", "foot", (38, 1, 1.95), 1.6),
           Touch("home_10", "header", "head", (44, 4), 1.0),
           Touch("away_5", "kick right high top", "foot", (16, -5, 0.3), 2.2),
           Touch("away_6", "receive right foot low", "foot", (14.5, -4.6), 0.9),
           Touch("away_6", "kick right low inside", "foot", (-6, 12), 1.9),
           Touch("away_14", "receive left foot low", "foot", (-8.4, 12), 0.8),
           Touch("away_14", "dribble", "foot", (-12.2, 10.8), 0.9),
           Touch("away_14", "dribble", "foot", (-16.4, 8.8), 0.9),
           Touch("away_14", "kick right low top", "foot", (-43.7, 0.8), 1.6),
           Touch("home_1", "receive right foot low", "foot", (-43, 0.8), 2.0))
"""All touches in order; the first is at KICK_OFF, each later one when the ball is there."""
EVENTS = {"kick": "pass", "header": "pass", "receive": "ball touch"}
"""What the provider calls a touch, by its first label; it does not list dribbles."""


@dataclass(frozen=True, eq=False)
class TimedTouch:
    """A touch with its flight.

    Attributes:
        touch: the touch.
        time: s.
        position: (3,) m, the ball's centre.
        flight: the ball's trajectory from there on.
    """

    touch: Touch
    time: float
    position: np.ndarray
    flight: Flight


@lru_cache(maxsize=1)
def compute_touches() -> tuple[TimedTouch, ...]:
    """Compute every touch with its time and flight."""
    time, position, found = KICK_OFF, np.array([0.0, 0.0, FOOTBALL.radius]), []
    for touch in TOUCHES:
        flight = _launch_ball(time, position, touch)
        found.append(TimedTouch(touch, time, position, flight))
        time += touch.seconds
        position = flight.at([time])[0]
    return tuple(found)


def _launch_ball(time: float, position: np.ndarray, touch: Touch) -> Flight:
    """Compute the flight after a touch."""
    if position[2] > 2.0 * FOOTBALL.radius and len(touch.target) == 2:  # the ball falls, and rolls on
        velocity = (np.array(touch.target) - position[:2]) / touch.seconds
        return simulate_flight(Launch(time, position, np.array([*velocity, -0.5])), FOOTBALL, touch.seconds + 6.0)
    target = np.array([*touch.target, FOOTBALL.radius][:3])
    aimed = (solve_ground_launches if len(touch.target) == 2 else solve_launches)(position, target, FOOTBALL,
                                                                                  seconds=touch.seconds)
    launch = Launch(time, position, aimed.velocity[0], aimed.spin[0])
    return simulate_flight(launch, FOOTBALL, touch.seconds + 6.0)


def compute_ball(times: np.ndarray) -> np.ndarray:
    """Compute the ball's centre (N, 3) m at `times` (N,) s."""
    touches = compute_touches()
    which = np.clip(np.searchsorted([t.time for t in touches], times, side="right") - 1, 0, None)
    out = np.empty((len(times), 3))
    for i in np.unique(which):
        out[which == i] = touches[i].flight.at(times[which == i])
    return out


def compute_player(player: str, times: np.ndarray) -> np.ndarray:
    """Compute where a player is (N, 2) m at `times` (N,) s, NaN off the pitch."""
    from scipy.interpolate import CubicSpline

    knots = dict(_list_touch_places(player))
    for time, *place in PLACES[player]:
        if all(abs(time - known) > 0.9 for known in knots):
            knots[float(time)] = np.array(place, float)
    when = np.array(sorted(knots))
    spline = CubicSpline(when, np.array([knots[time] for time in when]), bc_type="natural")
    places = spline(np.clip(times, when[0], when[-1]))
    first, last = PRESENT.get(player, (0.0, SECONDS))
    return np.where(((times >= first) & (times <= last))[:, None], places, np.nan)


def _list_touch_places(player: str) -> list[tuple[float, np.ndarray]]:
    """List (s, (2,) m) of the player at each touch: behind the ball as it leaves, under it for a header."""
    found = []
    for one in compute_touches():
        if one.touch.player == player:
            along = np.array(one.flight.launch.velocity[:2])
            reach = BESIDE if one.touch.part == "foot" else 0.2
            found.append((one.time, one.position[:2] - reach * along / np.linalg.norm(along)))
    return found


def simulate_feed() -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray]:
    """Simulate what the tracking system measures.

    Returns:
        Times (N,) s, per player (N, 2) m, and the lowest point of the ball (N, 3) m.
    """
    times = np.arange(round(SECONDS * RATE) + 1) / RATE
    seen = {player: add_tracking_noise(times, compute_player(player, times), 10 + i) for i,
            player in enumerate(PLAYERS)}
    ball = compute_ball(times)
    ball[:, :2] = add_tracking_noise(times, ball[:, :2], seed=9, slow=0.05)
    ball[:, 2] = np.maximum(ball[:, 2] - FOOTBALL.radius, 0.0)
    return times, seen, ball


def write_metrica(folder: Path) -> None:
    """Write `small_Home.csv`, `small_Away.csv`: places as shares of the pitch, y downward, no heights."""
    times, seen, ball = simulate_feed()
    for team in ("Home", "Away"):
        ids = [player for player in seen if player.startswith(team.lower())]
        heads = [[",,", *(f"{team}," for _ in ids), ","], [",,", *(f"{player.split('_')[1]}," for player in ids), ","],
                 ["Period,Frame,Time [s]", *(f"Player{player.split('_')[1]}," for player in ids), "Ball,"]]
        lines = [",".join(cells) for cells in heads]
        for row, time in enumerate(times):
            places = [*(seen[player][row] for player in ids), ball[row, :2]]
            cells = (f"{p[0] / LENGTH + 0.5:.5f},{0.5 - p[1] / WIDTH:.5f}" for p in places)
            lines.append(f"1,{row + 1},{time:.2f}," + ",".join(cells).replace("nan", "NaN"))
        _write_lines(folder / f"small_{team}.csv", lines)


def write_tracab(folder: Path) -> None:
    """Write `small.dat`, `small_meta.xml`: centimetres from the centre, heights, and names."""
    times, seen, ball = simulate_feed()
    lines = []
    for row, time in enumerate(times):
        found = []
        for target, (player, path) in enumerate(seen.items(), start=1):
            if np.isfinite(path[row, 0]):
                team, number = player.split("_")
                x, y = np.round(100.0 * path[row]).astype(int)
                found.append(f"{int(team == 'home')},{target},{number},{x},{y},0.00;")
        centimetres = ",".join(str(int(round(100.0 * value))) for value in ball[row])
        lines.append(f"{row + 1}:{''.join(found)}:{centimetres},0.00,H,Alive;:")
    _write_lines(folder / "small.dat", lines)
    _write_lines(folder / "small_meta.xml", [_format_tracab_meta(len(times))])


def _format_tracab_meta(frames: int) -> str:
    """Format the TRACAB metadata."""
    teams = []
    for number, team in enumerate(("home", "away"), start=1):
        rows = []
        for player in (player for player in PLAYERS if player.startswith(team)):
            first, last = (int(second * RATE) + 1 for second in PRESENT.get(player, (0.0, SECONDS)))
            first_name, last_name = PLAYERS[player].split()
            rows.append(
                f"<Player><PlayerId>{player}</PlayerId><FirstName>{first_name}</FirstName><LastName>{last_name}</LastName>"
                f"<JerseyNo>{player.split('_')[1]}</JerseyNo><StartFrameCount>{first}</StartFrameCount>"
                f"<EndFrameCount>{last}</EndFrameCount></Player>"
            )
        side = team.capitalize()
        name = {"home": "Reds", "away": "Blues"}[team]
        teams.append(
            f"<{side}Team><LongName>{name}</LongName><ShortName>{name}</ShortName><TeamId>{number}</TeamId>"
            f"<Players>{''.join(rows)}</Players></{side}Team>"
        )
    return (
        f'<TracabMetaData sVersion="1.0"><match iId="1" dtDate="2026-01-01 15:00:00" iFrameRateFps="{RATE:.0f}" '
        f'fPitchXSizeMeters="{LENGTH:.2f}" fPitchYSizeMeters="{WIDTH:.2f}" fTrackingAreaXSizeMeters="unknown" '
        f'fTrackingAreaYSizeMeters="unknown"><period iId="1" iStartFrame="1" iEndFrame="{frames}"/>'
        f'<period iId="2" iStartFrame="0" iEndFrame="0"/></match>{"".join(teams)}</TracabMetaData>'
    )


def write_events(folder: Path) -> None:
    """Write `small_events.csv`: a provider's events, on a clock of its own."""
    random = np.random.default_rng(7)
    lines = ["time_s,type,player,detail,success,x,y"]
    for one in compute_touches():
        kind = EVENTS.get(one.touch.words.split()[0])
        late = CLOCK_LATE + EVENTS_SCATTER * random.normal()
        x, y = one.position[:2] + 0.8 * random.normal(size=2)
        if kind is not None:
            detail = "head" if one.touch.part == "head" else "long_ball" if len(one.touch.target) == 3 else ""
            lines.append(f"{one.time + late:.1f},{kind},{one.touch.player},{detail},True,{x:.1f},{y:.1f}")
    _write_lines(folder / "small_events.csv", lines)


def write_truth(folder: Path) -> None:
    """Write `small_touches.csv`: every touch as it was planned, the ball's centre in metres."""
    lines = ["time_s,player,part,words,x_m,y_m,z_m"]
    for one in compute_touches():
        x, y, z = one.position
        lines.append(f"{one.time:.3f},{one.touch.player},{one.touch.part},{one.touch.words},{x:.3f},{y:.3f},{z:.3f}")
    _write_lines(folder / "small_touches.csv", lines)


def _write_lines(path: Path, lines: list[str]) -> None:
    """Write lines to a file."""
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def write_match_files(folder: Path = HERE / "match" / "small") -> None:
    """Write all files to `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    for write in (write_metrica, write_tracab, write_events, write_truth):
        write(folder)


if __name__ == "__main__":
    write_match_files(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "match" / "small")
