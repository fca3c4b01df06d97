"""Pictures from which touches are read by eye when who touched the ball:
`python -m benchmarks.touch_reading MATCH FROM TO --out FOLDER`.

Nothing here looks for touches. A picture shows some seconds of what the feed says: the ball's speed and the change of
its velocity from sample to sample, its direction of travel, its height, how far away the nearest players are, and the
trail over the ground with the time written along it. What was read stands in benchmarks/touches_by_hand.csv.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from beyond_mocap.files.tracking import Match, read_match  # noqa: E402

from benchmarks.places import DATA  # noqa: E402

MATCHES = {"nl2019": "nl2019_half1.dat", "dutch": "dutch_6min.dat"}
NEAR, FEW = 3.0, 5  # players nearer than this many metres are shown, at most so many


def match_of(name: str) -> Match:
    """One of the recorded matches."""
    return read_match(DATA / "tracking" / "match" / MATCHES[name])


def nearest(match: Match, part: np.ndarray) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Players who come near the ball in `part` (sample indices): id, (n,) metres from the ball, (n, 2) positions."""
    ball = match.ball[part, :2]
    found = []
    for player, path in zip(match.players, match.positions):
        away = np.linalg.norm(path[part] - ball, axis=1)
        if np.isfinite(away).any() and np.nanmin(away) < NEAR:
            found.append((player.id, away, path[part]))
    return sorted(found, key=lambda one: np.nanmin(one[1]))[: 2 * FEW]


def picture(match: Match, start: float, end: float, path: Path) -> None:
    """Writes the picture of `start` to `end` seconds."""
    from matplotlib import pyplot
    from matplotlib.ticker import MultipleLocator

    part = np.flatnonzero((match.times >= start - 1e-6) & (match.times <= end + 1e-6))
    times, ball = match.times[part], match.ball[part]
    velocity = np.diff(ball[:, :2], axis=0) * match.fps
    between = (times[1:] + times[:-1]) / 2
    speed = np.linalg.norm(velocity, axis=1)
    change = np.linalg.norm(np.diff(velocity, axis=0), axis=1)
    direction = np.degrees(np.arctan2(velocity[:, 1], velocity[:, 0]))
    figure, axes = pyplot.subplots(5, 1, figsize=(15.6, 16.4), dpi=100, height_ratios=(2, 1.3, 1, 2, 5))
    axes[0].plot(between, speed, ".-", lw=0.7, ms=4, color="black")
    axes[0].bar(times[1:-1], change, 0.02, color="tab:red", alpha=0.55)
    axes[0].set_ylabel("speed (black)\nchange (red) m/s")
    axes[0].set_ylim(0, min(35, max(8, np.nanmax(speed) * 1.1)))
    axes[1].plot(between[speed > 0.5], direction[speed > 0.5], ".", ms=4, color="black")
    axes[1].set_ylim(-190, 190)
    axes[1].yaxis.set_major_locator(MultipleLocator(90))
    axes[1].set_ylabel("direction °")
    axes[2].plot(times, ball[:, 2], ".-", lw=0.7, ms=4)
    axes[2].set_ylabel("height m")
    axes[2].set_ylim(-0.2, max(2.0, np.nanmax(ball[:, 2], initial=0.0) * 1.1))
    low, high = np.nanmin(ball[:, :2], axis=0) - 3, np.nanmax(ball[:, :2], axis=0) + 3
    for number, (name, away, places) in enumerate(nearest(match, part)):
        colour = pyplot.get_cmap("tab10")(number % 10)
        line = "-" if name.startswith("home") else "--"
        axes[3].plot(times, away, line, lw=1.3, color=colour, label=name)
        closest = int(np.nanargmin(away))
        axes[3].annotate(name, (times[closest], away[closest]), fontsize=9, color=colour)
        close = away < NEAR
        axes[4].plot(*places.T, line, lw=0.5, color=colour, alpha=0.6)
        axes[4].plot(*places[close].T, ".", ms=3, color=colour)
        axes[4].annotate(name, places[closest], fontsize=10, color=colour)
    axes[3].set_ylim(0, NEAR)
    axes[3].set_ylabel("player to ball m")
    axes[3].legend(loc="upper right", fontsize=8, ncols=5)
    for axis in axes[:4]:
        axis.set_xlim(start, end)
        axis.xaxis.set_major_locator(MultipleLocator(0.5))
        axis.xaxis.set_minor_locator(MultipleLocator(0.1))
        axis.grid(True, which="major", lw=0.8)
        axis.grid(True, which="minor", lw=0.3)
    axes[4].plot(ball[:, 0], ball[:, 1], ".-", lw=0.6, ms=3, color="black")
    for time in np.arange(np.ceil(start * 2) / 2, end, 0.5):
        at = ball[np.argmin(np.abs(times - time)), :2]
        axes[4].plot(*at, "o", ms=5, color="red")
        axes[4].annotate(f"{time:.1f}", at, fontsize=8, color="red", xytext=(3, 3), textcoords="offset points")
    axes[4].set_aspect("equal", adjustable="datalim")
    axes[4].set_xlim(low[0], high[0])
    axes[4].set_ylim(low[1], high[1])
    axes[4].grid(True, lw=0.3)
    figure.suptitle(f"{path.stem}", y=0.995, fontsize=10)
    figure.tight_layout(pad=0.4)
    figure.savefig(path)
    pyplot.close(figure)


def main() -> int:
    """Writes the pictures asked for."""
    options = argparse.ArgumentParser(prog="python -m benchmarks.touch_reading", description=__doc__)
    options.add_argument("match", choices=tuple(MATCHES))
    options.add_argument("start", type=float)
    options.add_argument("end", type=float)
    options.add_argument("--window", type=float, default=8.0, help="seconds of a picture")
    options.add_argument("--out", type=Path, required=True)
    chosen = options.parse_args()
    import matplotlib

    matplotlib.use("agg")
    match = match_of(chosen.match)
    chosen.out.mkdir(parents=True, exist_ok=True)
    for start in np.arange(chosen.start, chosen.end - 1e-6, chosen.window):
        end = start + chosen.window
        picture(match, start, end, chosen.out / f"{chosen.match}_{start:06.1f}_{end:06.1f}.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
