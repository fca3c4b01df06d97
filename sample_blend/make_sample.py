"""Generate the sample: a library of clips (`library/*.bvh` with labels in `.txt`) and a passage of a match (`match/*`).

    python sample_blend/make_sample.py [FOLDER]

Everything is computed from `beyond_mocap.synthetic.gait` and `gestures`; the same code gives the same bytes. Needs the
core only.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
if __name__ == "__main__":
    sys.path.insert(0, str(HERE.parent))

from beyond_mocap.annotation import KeyMoment, Span, Timeline, format_timeline  # noqa: E402
from beyond_mocap.base.time_series import (  # noqa: E402
    find_equal_runs,  # noqa: E402
    hann_smooth,
    interpolate_columns,
)
from beyond_mocap.base.vectors import unit_vectors  # noqa: E402
from beyond_mocap.files.bvh import bvh  # noqa: E402
from beyond_mocap.motion.motion import Motion  # noqa: E402
from beyond_mocap.synthetic.actions.receptions import build_reception  # noqa: E402
from beyond_mocap.synthetic.gait import build_gait  # noqa: E402
from beyond_mocap.synthetic.gestures import Gesture, build_dribble, build_strike  # noqa: E402
from beyond_mocap.synthetic.moves import build_celebration, build_get_up, build_header, build_throw_in  # noqa: E402

FPS = 30.0
# speeds (m/s) at which one gait's label ends and the next begins, as in Faustino's data
_GAITS = (("standing", 0.4), ("walking", 2.0), ("jogging", 4.0), ("running", 5.5), ("sprinting", np.inf))


@dataclass(frozen=True)
class Clip:
    """A clip of the library before it is written.

    Attributes:
        name: file name without ending.
        motion: the motion.
        words: labels of the whole clip, None: by speed.
        gesture: its key moment.
    """

    name: str
    motion: Motion
    words: tuple[str, ...] | None
    gesture: Gesture | None = None


def build_clips() -> list[Clip]:
    """Build all clips of the sample's library, in the order of their kinds."""
    return [*_build_standing(), *_build_straight(), *_build_curves(), *_build_directions(), *_build_speed_changes(),
            *_build_moves()]


def _build_standing() -> list[Clip]:
    """Build clips of standing and turning on the spot."""
    turn = np.concatenate([np.zeros(45), np.full(60, 0.9), np.zeros(60), np.full(75, 0.7), np.zeros(45)])
    out = [Clip("standing_1", build_gait(0.0, 8.0, FPS, seed=1), None),
           Clip("standing_2", build_gait(0.0, 6.0, FPS, seed=2), None)]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        words = ("standing", "turning", side)
        out.append(Clip(f"standing_turn_{side}", build_gait(0.0, None, FPS, turn_rate=sign * _smooth_corners(turn),
                                                            seed=3), words))
    return out


def _build_straight() -> list[Clip]:
    """Build clips of steady locomotion."""
    table = (("walking", (0.8, 1.2, 1.6), 6.4), ("jogging", (2.4, 2.9, 3.5), 6.0), ("running", (4.2, 4.9), 6.0),
             ("sprinting", (6.0, 7.2, 8.6), 6.0))
    return [
        Clip(f"{word}_{speed:.1f}".replace(".", "_"), build_gait(speed + _build_unsteadiness(seconds, i), None, FPS,
                                                                 seed=10 + i), None) for word, speeds, seconds in table
        for i, speed in enumerate(speeds)
    ]


def _build_curves() -> list[Clip]:
    """Build clips of locomotion in curves."""
    out = []
    for word, speed, rate, seconds in (("walking", 1.3, 0.75, 7.0), ("jogging", 2.8, 0.7, 6.0),
                                       ("running", 4.6, 0.5, 6.0)):
        for side, sign in (("left", 1.0), ("right", -1.0)):
            times = _clip_times(seconds)
            rates = sign * rate * (0.25 + 1.5 * np.sin(np.pi * times / seconds) ** 2)
            out.append(
                Clip(f"{word}_turn_{side}", build_gait(speed, None, FPS, turn_rate=rates, seed=20),
                     (word, "turning", side))
            )
    times = _clip_times(8.0)
    weave = 0.9 * np.sin(2 * np.pi * times / 4.2) + 0.5 * np.sin(2 * np.pi * times / 2.7)
    out.append(Clip("jogging_weave", build_gait(3.0 + 0.5 * np.sin(0.9 * times), None, FPS, turn_rate=weave, seed=21),
                    None))
    return out


def _build_directions() -> list[Clip]:
    """Build clips of locomotion backward and sideways."""
    out = []
    for word, direction, angle, speed in (("walking", "back", np.pi, 1.1), ("jogging", "back", np.pi, 2.3),
                                          ("walking", "left", np.pi / 2, 0.9), ("walking", "right", -np.pi / 2, 0.9)):
        speeds = _build_speed_profile(((0, 0), (1.2, speed), (5.2, speed), (6.4, 0), (6.8, 0)))
        out.append(Clip(f"{word}_{direction}", build_gait(speeds, None, FPS, direction=angle, seed=30),
                        (word, direction)))
    return out


def _build_speed_changes() -> list[Clip]:
    """Build clips that change speed."""
    table = {
        "start_stop_walking": ((0, 0), (0.8, 0), (2.0, 1.3), (4.0, 1.4), (5.4, 0), (6.4, 0), (7.4, 0.9), (8.6, 0),
                               (9.4, 0)),
        "walk_jog_walk": ((0, 1.3), (1.5, 1.5), (3.2, 2.8), (5.5, 3.0), (7.5, 1.5), (9.0, 1.3)),
        "jog_run_jog": ((0, 2.6), (1.5, 2.9), (4.0, 4.8), (6.0, 4.8), (8.5, 2.7), (9.5, 2.6)),
        "stand_sprint_stop": ((0, 0), (0.6, 0), (1.8, 4.0), (4.6, 8.2), (6.0, 8.4), (9.6, 1.0), (10.6, 0), (11.2, 0)),
        "jog_sprint_jog": ((0, 2.7), (1.0, 2.9), (4.2, 7.6), (5.4, 7.6), (8.6, 2.9), (9.4, 2.7)),
        "run_stop_run": ((0, 4.0), (1.0, 4.0), (3.2, 0.3), (4.0, 0.2), (6.4, 4.4), (7.4, 4.4)),
    }
    return [
        Clip(name, build_gait(_build_speed_profile(rows), None, FPS, seed=40 + i), None) for i,
        (name, rows) in enumerate(table.items())
    ]


def _build_moves() -> list[Clip]:
    """Build clips of dribbling, kicks and other moves."""
    weave = 0.8 * np.sin(2 * np.pi * _clip_times(7.0) / 3.5)
    out = [
        Clip("dribble_jogging", build_dribble(2.7, 7.0, fps=FPS, seed=50, turn_rate=weave),
             ("dribble", "jogging", "front")), Clip("dribble_walking", build_dribble(1.7, 6.0, fps=FPS, seed=51),
                                                    ("dribble", "walking", "front")),
        Clip("dribble_running", build_dribble(4.3, 6.0, fps=FPS, seed=52), ("dribble", "running", "front")),
        Clip("celebration", build_celebration(6.4, fps=FPS, seed=53), ("celebration", "running", "arms", "outside")),
    ]
    for name, gesture, words in (
        ("kick_low_inside", build_strike("kick low inside"), "kick right low inside running front"),
        ("kick_low_inside_slow", build_strike("kick low inside", fps=FPS, speed=0.6, seed=1),
         "kick right low inside standing front"),
        ("kick_low_top", build_strike("kick low top"), "kick right low top running front"),
        ("receive_foot", build_reception("inside", speed=1.8), "receive right foot low inside front"),
        ("header", build_header(fps=FPS), "header standing jump front"),
        ("throw_in", build_throw_in(fps=FPS), "throwb high front"),
        ("getting_up", build_get_up(fps=FPS), "getting_up long_duration back"),
    ):
        out.append(Clip(name, gesture.motion, tuple(words.split()), gesture))
    return out


def label_clip(clip: Clip) -> Timeline:
    """Return the annotation of a clip."""
    end = clip.motion.duration
    if clip.gesture is None:
        return Timeline(tuple(_label_by_speed(clip.motion)) if clip.words is None else (Span(0.0, end, clip.words),),
                        ())
    start, stop = round(clip.gesture.start, 2), round(min(clip.gesture.end, end), 2)
    around = [s for s in _label_by_speed(clip.motion) if s.end <= start + 0.5 or s.start >= stop - 0.5]
    around = [
        Span(s.start, min(s.end, start), s.words) if s.start < start else Span(max(s.start, stop), s.end, s.words)
        for s in around
    ]
    if clip.name == "getting_up":
        around = [Span(0.0, start, ("ground", "back"))]
    move = Span(start, stop, clip.words)
    return Timeline((*(s for s in around if s.end > s.start + 0.2), move), (KeyMoment(clip.gesture.key, clip.words),))


def _label_by_speed(motion: Motion) -> list[Span]:
    """Label stretches of one gait by the speed of the root, smoothed over a second; short ones join the one before."""
    width = int(motion.fps)
    window = np.hanning(width + 2)[1:-1]
    padded = np.pad(motion.root_positions[:, :2], ((width // 2, width - 1 - width // 2), (0, 0)), mode="reflect",
                    reflect_type="odd")
    smooth = np.stack([np.convolve(padded[:, a], window / window.sum(), mode="valid") for a in (0, 1)], axis=-1)
    velocity = np.gradient(smooth, 1.0 / motion.fps, axis=0)
    names = np.searchsorted([limit for _, limit in _GAITS], np.linalg.norm(velocity, axis=1), side="right")
    spans: list[list] = []
    for begin, end in find_equal_runs(names):
        word = _GAITS[names[begin]][0]
        if spans and (end - begin < 0.4 * motion.fps or spans[-1][2] == word):
            spans[-1][1] = end
        else:
            spans.append([begin, end, word])
    return [
        Span(round(begin / motion.fps, 3), round((end - 1) / motion.fps, 3),
             (word,) if word == "standing" else (word, "front"))
        for begin, end, word in spans
    ]


def _clip_times(seconds: float) -> np.ndarray:
    """Return the times (T,) s of a clip."""
    return np.arange(int(round(seconds * FPS)) + 1) / FPS


def _build_speed_profile(rows) -> np.ndarray:
    """Build speeds (T,) through rows (seconds, m/s), corners rounded over half a second."""
    seconds, values = np.array(rows, dtype=float).T
    return _smooth_corners(np.interp(_clip_times(seconds[-1]), seconds, values))


def _smooth_corners(values: np.ndarray) -> np.ndarray:
    """Smooth values over 0.6 s."""
    return hann_smooth(values, int(0.3 * FPS))


def _build_unsteadiness(seconds: float, seed: int) -> np.ndarray:
    """Build a slight unsteadiness of a steady speed (T,), some hundredths of m/s."""
    times = _clip_times(seconds)
    return 0.06 * np.sin(2 * np.pi * times / 3.7 + seed) + 0.04 * np.sin(2 * np.pi * times / 2.3 + 2 * seed)


# -- the passage of a match
# ----------------------------------------------------------------------------------------------------------

MATCH_RATE = 10.0  # frames per second
MATCH_SECONDS = 40.0
BALL_RADIUS = 0.11  # m
# s, x m, y m: true positions of the players (their tracks add the noise of a tracking system)
PATHS = {
    "player1": ((0, -21, 7.6), (1.5, -21, 7.6), (3, -19.6, 7.7), (4.5, -16.2, 7.6), (6, -12.4, 6.6), (7.4, -9.2, 4.6),
                (8.5, -6.9, 2.9), (9.5, -4.9, 2.2), (10.5, -1.0, 2.4), (11.5, 4.7, 3.7), (12.5, 11.9, 5.5),
                (13.5, 19.0, 7.5), (14.3, 22.8, 9.0), (15.1, 24.6, 10.2), (16, 25.2, 10.5), (17, 24.6, 9.3),
                (17.9, 23.9, 8.0), (18.6, 23.8, 7.2), (19.4, 24.6, 6.5), (20.5, 26.9, 5.9), (22, 31.2, 5.0),
                (23.5, 36.0, 3.9), (24.8, 39.4, 3.1), (25.6, 40.7, 2.8), (26.6, 42.8, 3.2), (28, 46.6, 5.6),
                (29.4, 49.0, 9.6), (30.8, 48.6, 14.0), (32, 46.4, 16.4), (33.4, 44.9, 17.2), (35, 44.2, 17.5),
                (40, 44.1, 17.5)),
    "player2": ((0, 15.6, -11.2), (2, 15.5, -11.1), (4, 15.2, -10.2), (6, 14.2, -9.4), (7.5, 11.8, -8.4),
                (8.8, 8.6, -7.3), (9.6, 7.0, -6.7), (10.2, 6.4, -6.4), (10.9, 5.9, -6.0), (11.7, 6.0, -5.1),
                (12.6, 7.2, -4.5), (14, 10.6, -3.2), (15.3, 14.0, -1.4), (16.5, 16.9, 1.0), (17.2, 18.0, 2.0),
                (18.5, 20.1, 2.5), (20.5, 24.0, 0.8), (22.5, 29.2, -2.4), (24.5, 34.6, -5.0), (26, 37.8, -4.8),
                (27, 40.0, -2.4), (28, 42.2, 1.6), (29, 44.2, 6.4), (30, 45.3, 10.8), (31, 45.2, 13.6),
                (32, 44.5, 15.0), (33.5, 43.5, 15.9), (35, 43.0, 16.3), (36, 43.0, 16.3), (37.2, 42.4, 15.6),
                (39, 40.4, 14.0), (40, 39.4, 13.2)),
}
# touches: seconds, player, labels
TOUCHES = ((8.5, "player1", "kick right running low inside"), (10.2, "player2", "receive right foot low inside"),
           (16.5, "player2", "kick right running low inside"), (17.9, "player1", "receive right foot low inside"),
           (24.8, "player1", "kick right running low top"))
DRIBBLES = ((1.0, 8.5, "player1"), (10.2, 16.5, "player2"), (17.9, 24.8, "player1"))
NET = (25.5, (53.2, 1.4, 0.9))
STRETCHES = {
    "player1": ((2.4, 8.0, "jogging dribble"), (19.2, 24.2, "jogging dribble"),
                (26.4, 31.4, "celebration running arms outside")),
    "player2": ((11.6, 16.0, "jogging dribble"),),
}


def compute_true_paths() -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray]:
    """Compute the true paths, without noise.

    Returns:
        Times (N,) s at 100 Hz, players' positions (N, 2) m by name, and the ball's (N, 3) m.
    """
    times = np.arange(int(MATCH_SECONDS * 100) + 1) / 100.0
    players = {name: _round_path(rows, times) for name, rows in PATHS.items()}
    return times, players, _compute_ball(times, players)


def _round_path(rows, times: np.ndarray) -> np.ndarray:
    """Build a path (N, 2) through waypoints, rounded in space and speed by a Hann window of 1.2 s, twice."""
    table = np.array(rows, dtype=float)
    path = interpolate_columns(times, table[:, 0], table[:, 1:3])
    for _ in range(2):
        path = np.stack([hann_smooth(column, 60) for column in path.T], axis=-1)
    return path


def _compute_ball(times: np.ndarray, players: dict[str, np.ndarray]) -> np.ndarray:
    """Compute the ball (N, 3): rolled ahead from touch to touch in a dribble, rolling or flying between players."""
    ball = np.full((len(times), 3), np.nan)
    for begin, end, name in DRIBBLES:
        inside = (times >= begin - 1e-9) & (times <= end + 1e-9)
        ball[inside] = _dribble_ball(times, players[name], begin, end)[inside]
    ball[times < DRIBBLES[0][0]] = ball[np.flatnonzero(np.isfinite(ball[:, 0]))[0]]
    for a, b in ((8.5, 10.2), (16.5, 17.9)):
        inside = (times > a) & (times < b)
        start, stop = (ball[np.argmin(np.abs(times - t))] for t in (a, b))
        share = (times[inside] - a) / (b - a)
        share = share * (1.18 - 0.18 * share)  # rolling slows it down
        ball[inside] = start + (stop - start) * share[:, None]
    return _add_shot(ball, times)


def _add_shot(ball: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Add the shot at goal to the ball (N, 3)."""
    kick, (net, target) = TOUCHES[-1][0], NET
    flying = (times > kick) & (times <= net)
    start = ball[np.argmin(np.abs(times - kick))]
    at = times[flying] - kick
    duration = net - kick
    rise = (target[2] - start[2] + 0.5 * 9.81 * duration**2) / duration
    ball[flying, :2] = start[:2] + (np.array(target[:2]) - start[:2]) * (at / duration)[:, None]
    ball[flying, 2] = start[2] + rise * at - 0.5 * 9.81 * at**2
    after = times > net
    drop = np.maximum(target[2] - 0.5 * 9.81 * (times[after] - net) ** 2, BALL_RADIUS)
    ball[after] = np.stack([np.full(after.sum(), target[0]), np.full(after.sum(), target[1]), drop], axis=-1)
    return ball


def _dribble_ball(times: np.ndarray, path: np.ndarray, begin: float, end: float) -> np.ndarray:
    """Compute the ball (N, 3) of a dribble: half a metre ahead at each touch, further between."""
    velocity = np.gradient(path, times, axis=0)
    speed = np.linalg.norm(velocity, axis=1)
    direction = velocity / np.maximum(speed, 0.05)[:, None]
    half = 25
    direction = np.stack(
        [
            np.convolve(np.pad(direction[:, a], half, mode="edge"), np.full(2 * half + 1, 1 / (2 * half + 1)), "valid")
            for a in (0, 1)
        ],
        -1,
    )
    direction = unit_vectors(direction, min_length=1e-6)
    since = ((end - times) / 0.75) % 1.0
    running = np.clip((times - begin) / 0.8, 0.0, 1.0) * np.minimum(speed, 3.5)
    ahead = 0.46 + 0.16 * running * np.sin(np.pi * since) ** 1.5
    right = np.stack([direction[:, 1], -direction[:, 0]], axis=-1)
    place = path + ahead[:, None] * direction + 0.10 * right
    return np.column_stack([place, np.full(len(times), BALL_RADIUS)])


def add_tracking_noise(times: np.ndarray, positions: np.ndarray, seed: int, slow: float = 0.08,
                       fast: float = 0.01) -> np.ndarray:
    """Add the noise of a tracking system.

    Optical systems have 8 to 9 cm against truth, and about 1 cm between frames.

    Args:
        times: (M,) s.
        positions: (M, K) m.
        seed: of the noise.
        slow: m RMS that drift over seconds.
        fast: m RMS from frame to frame.
    """
    random = np.random.default_rng(seed)
    drift = random.normal(size=(len(times) + 80, positions.shape[1]))
    window = np.hanning(43)[1:-1]
    drift = np.stack([np.convolve(drift[:, a], window, mode="valid")[: len(times)] for a in range(positions.shape[1])],
                     -1)
    drift = drift / np.sqrt(np.sum(window**2))
    return positions + slow * drift / np.sqrt(2.0) + fast * random.normal(size=positions.shape)


def write_match(folder: Path) -> None:
    """Write `player1.csv`, `player2.csv` (track and ball at 10 Hz) and their `.txt` timelines."""
    times, players, ball = compute_true_paths()
    every = slice(None, None, int(100 / MATCH_RATE))
    seen_ball = ball[every].copy()
    seen_ball[:, :2] = add_tracking_noise(times[every], seen_ball[:, :2], seed=99, slow=0.05)
    for seed, (name, path) in enumerate(players.items(), start=1):
        seen = add_tracking_noise(times[every], path[every], seed)
        rows = np.column_stack([times[every], seen, seen_ball])
        head = "time_s,x_m,y_m,ball_x_m,ball_y_m,ball_z_m"
        lines = [head, *(f"{r[0]:.1f}," + ",".join(f"{v:.3f}" for v in r[1:]) for r in rows)]
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
        spans = tuple(Span(begin, end, tuple(words.split())) for begin, end, words in STRETCHES[name])
        keys = tuple(KeyMoment(at, tuple(words.split())) for at, who, words in TOUCHES if who == name)
        text = f"# {name} of the sample passage: what is not said here is automatic\n" + format_timeline(
            Timeline(spans, keys)
        )
        (folder / f"{name}.txt").write_text(text, encoding="utf-8", newline="\n")


def write_library(folder: Path) -> None:
    """Write each clip as `NAME.bvh` with its labels in `NAME.txt`."""
    for clip in build_clips():
        bvh.write_bvh(folder / f"{clip.name}.bvh", clip.motion)
        (folder / f"{clip.name}.txt").write_text(format_timeline(label_clip(clip)), encoding="utf-8", newline="\n")


def write_sample(folder: Path = HERE) -> None:
    """Write the whole sample below `folder`."""
    for part, write in (("library", write_library), ("match", write_match)):
        (folder / part).mkdir(parents=True, exist_ok=True)
        write(folder / part)


if __name__ == "__main__":
    write_sample(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
