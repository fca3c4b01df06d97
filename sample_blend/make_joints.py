"""Generate skeletal tracking and freeze frames of the small match of `make_match`.

    python sample_blend/make_joints.py [FOLDER]

`small/small_joints.csv` has the joints of two players who run for six seconds without the ball, where the match's dots
are, with the noise of cameras; their bodies are synthetic gaits. `moment/360.json` and `moment/events.json` are what
StatsBomb would note of three touches: where all players are, and who does what. The same code gives the same bytes.
Needs the core only.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
if __name__ == "__main__":
    sys.path[:0] = [str(HERE.parent), str(HERE)]

from make_match import LENGTH, PLAYERS, RATE, WIDTH, TimedTouch, compute_player, compute_touches  # noqa: E402

from beyond_mocap.files.joints.landmarks import LANDMARKS  # noqa: E402
from beyond_mocap.motion.humanoid import identify_joints  # noqa: E402
from beyond_mocap.motion.motion import forward_kinematics  # noqa: E402
from beyond_mocap.skeletal.body_figures import list_fitted  # noqa: E402
from beyond_mocap.synthetic.gait import build_gait  # noqa: E402

RUNNERS = {"home_10": (2.0, 8.0), "away_9": (2.0, 8.0)}
"""Players whose joints cameras see, and from when to when (s)."""
NOISE = 0.02  # m, standard deviation of each coordinate of a joint
MOMENTS = (0, 7, 8)
"""Numbers of the touches that have a freeze frame: a pass, a cross and a header."""
FIELD = (120.0, 80.0)  # StatsBomb's units


def compute_joints(player: str, times: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Compute the joints of a player who runs.

    Args:
        player: id of the player.
        times: (T,) s, RATE per second.
    Returns:
        L landmarks, and (T, L, 3) m.
    """
    places = compute_player(player, times)
    velocity = np.gradient(places, times, axis=0)
    heading = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
    motion = build_gait(np.linalg.norm(velocity, axis=1), fps=RATE, turn_rate=np.gradient(heading, times))
    joints, _ = forward_kinematics(motion)
    turn = np.array([(np.cos(heading[0]), -np.sin(heading[0])), (np.sin(heading[0]), np.cos(heading[0]))])
    joints[..., :2] = joints[..., :2] @ turn.T + places[0]
    body = identify_joints(motion.skeleton)
    toes = {LANDMARKS.index(f"{side}_big_toe"): getattr(body, side).toe for side in ("left", "right")}
    fitted = {**list_fitted(LANDMARKS, motion), **toes}
    return [LANDMARKS[number] for number in fitted], joints[:, list(fitted.values())]


def write_joints(path: Path) -> None:
    """Write the joints of all runners as a table."""
    random, lines = np.random.default_rng(5), ["time_s,player,team,joint,x,y,z"]
    for player, (start, end) in RUNNERS.items():
        times = start + np.arange(round((end - start) * RATE) + 1) / RATE
        names, joints = compute_joints(player, times)
        joints = joints + NOISE * random.normal(size=joints.shape)
        lines += [f"{time:.2f},{player},{player.split('_')[0]},{name},{x:.3f},{y:.3f},{z:.3f}"
                  for time, row in zip(times, joints) for name, (x, y, z) in zip(names, row)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def write_moments(folder: Path) -> None:
    """Write the freeze frames and the events of some touches."""
    touches = compute_touches()
    found = [(touches[number], touches[number + 1]) for number in MOMENTS]
    frames = [{"event_uuid": f"moment-{number}", "freeze_frame": _list_people(one)}
              for number, (one, _) in enumerate(found, 1)]
    events = [_build_event(f"moment-{number}", one, after) for number, (one, after) in enumerate(found, 1)]
    for name, value in (("360.json", frames), ("events.json", events)):
        (folder / name).write_text(json.dumps(value, indent=1) + "\n", encoding="utf-8", newline="\n")


def _to_field(place: np.ndarray, team: str) -> list[float]:
    """Convert a place on the pitch to StatsBomb's units, in which each team attacks to the right."""
    way = 1.0 if team == "home" else -1.0
    return [round((way * place[0] / LENGTH + 0.5) * FIELD[0], 1), round((0.5 - way * place[1] / WIDTH) * FIELD[1], 1)]


def _list_people(one: TimedTouch) -> list[dict]:
    """List the people in the picture at a touch, each with their place and their part in it."""
    team, people = one.touch.player.split("_")[0], []
    for player in PLAYERS:
        place = compute_player(player, np.array([one.time]))[0]
        if np.isfinite(place).all():
            people.append({"teammate": player.startswith(team), "actor": player == one.touch.player,
                           "keeper": player.endswith("_1"), "location": _to_field(place, team)})
    return people


def _build_event(name: str, one: TimedTouch, after: TimedTouch) -> dict:
    """Build the event of a touch that passes the ball to where the next one is."""
    team, words = one.touch.player.split("_")[0], one.touch.words.split()
    part = "Head" if one.touch.part == "head" else f"{'Left' if 'left' in words else 'Right'} Foot"
    height = {"id": 3, "name": "High Pass"} if "high" in words else {"id": 1, "name": "Ground Pass"}
    return {
        "id": name, "minute": int(one.time // 60), "second": int(one.time % 60), "type": {"id": 30, "name": "Pass"},
        "team": {"name": {"home": "Reds", "away": "Blues"}[team]}, "player": {"name": PLAYERS[one.touch.player]},
        "location": _to_field(one.position, team), "duration": round(after.time - one.time, 3),
        "pass": {"end_location": _to_field(after.position, team), "height": height, "body_part": {"name": part}},
    }  # fmt: skip


def write_files(folder: Path = HERE / "match") -> None:
    """Write all files below `folder`."""
    for name in ("small", "moment"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    write_joints(folder / "small" / "small_joints.csv")
    write_moments(folder / "moment")


if __name__ == "__main__":
    write_files(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "match")
