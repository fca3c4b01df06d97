"""Recordings repeated until a longer path is filled: `python -m benchmarks.path_cycles`.

Each recording of `path_editing` rides straight paths of 0.3 to 5 times its own length. Jerk at seams stands over what
the recording itself has at that speed (its 95th percentile); the foot speed beside it is of standing feet within a
quarter of a second of a seam.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from beyond_mocap.errors import InputError
from beyond_mocap.evaluation import jerk, root
from beyond_mocap.motion.humanoid import identify
from beyond_mocap.motion.motion import Motion, forward_kinematics
from beyond_mocap.polish.path_line import through
from beyond_mocap.ride import Ridden, RideSettings, RideSource, prepare, ride

from benchmarks import markdown
from benchmarks.effort import on_one_core
from benchmarks.path_editing import CLIPS, recording
from benchmarks.places import DATA

TIMES = (0.3, 0.7, 1.02, 1.5, 2.0, 3.0, 5.0)
COLUMNS = ("times its length", "rides", "told instead", "own end met", "cycled", "seam jerk / own p95", "above it",
           "skate cm/s (own)")
_NEAR = 0.25  # seconds


@dataclass(frozen=True)
class Cycle:
    """One ride: whether it ends with the recording's own end, its seams' jerk over the recording's own, and metres per
    second of standing feet near seams and all through the recording."""

    name: str
    ends: bool
    jerk: np.ndarray
    skate: float
    own_skate: float


def cycles(times: float, kinds: Iterable[str] = tuple(CLIPS)) -> tuple[list[Cycle], list[str]]:
    """What became of every recording on a path `times` as long as its own, and what was told where nothing could."""
    rides, told = [], []
    for kind in kinds:
        for name in CLIPS[kind]:
            source = prepare(recording(kind, name), RideSettings())
            path = through(np.array([[0.0, 0.0, 0.0], [times * source.arc.length, 0.0, 0.0]]), "path")
            try:
                rides.append(_cycle(f"{kind} {name}", source, ride(source, path, RideSettings(cycle=True))))
            except InputError as error:
                told.append(f"{kind} {name}: {error}")
    return rides, told


def _cycle(name: str, source: RideSource, ridden: Ridden) -> Cycle:
    near = np.zeros(len(ridden.motion), dtype=bool)
    reach = int(_NEAR * ridden.motion.fps)
    for seam in ridden.seams:
        near[max(seam - reach, 0) : seam + reach] = True
    ends = ridden.frames[-1] > len(source.motion) - 2.5
    own = _skate(source.motion, source.standing, np.ones(len(source.motion), dtype=bool))
    return Cycle(name, bool(ends), _seam_jerk(source, ridden), _skate(ridden.motion, ridden.standing, near), own)


def _seam_jerk(source: RideSource, ridden: Ridden) -> np.ndarray:
    """(S,) jerk around each seam over the recording's own at that speed."""
    mine, own = (
        (jerk.jerk(forward_kinematics(m)[0], m.fps), root.travel_speed(m.root_positions[:, :2], m.fps))
        for m in (ridden.motion, source.motion)
    )
    windows, speed = jerk.uncut_windows(*own)
    if not len(windows):
        return np.zeros(0)
    return jerk.seam_ratios(mine[0], ridden.seams, mine[1], jerk.real_p95(windows, speed, min(30, len(windows))))


def _skate(motion: Motion, standing: np.ndarray, which: np.ndarray) -> float:
    """Mean m/s of heels and toes of feet that stand flat in frames `which` (T,); NaN without any."""
    places, body, found = forward_kinematics(motion)[0], identify(motion.skeleton), []
    for side, limb in enumerate((body.left, body.right)):
        moves = np.gradient(places[:, [limb.foot, limb.toe_or_foot], :2], axis=0) * motion.fps
        found.append(np.linalg.norm(moves, axis=-1).mean(axis=1)[which & standing[:, side].all(axis=1)])
    found = np.concatenate(found)
    return float(found.mean()) if len(found) else np.nan


def line(times: float, rides: list[Cycle], told: list[str]) -> str:
    """A row of the table."""
    around = [one for one in rides if len(one.jerk)]
    most = np.array([one.jerk.max() for one in around])
    cells = [f"{times:g}", str(len(rides)), str(len(told)), str(sum(one.ends for one in rides)), str(len(around))]
    if not len(around):
        return markdown.row([*cells, "", "", ""])
    skate, own = (np.nanmedian([getattr(one, name) for one in around]) * 100.0 for name in ("skate", "own_skate"))
    spread = f"{np.median(most):.2f}, p90 {np.percentile(most, 90):.2f}, most {most.max():.2f}"
    return markdown.row([*cells, spread, str(int((most > 1.005).sum())), f"{skate:.1f} ({own:.1f})"])


def main() -> int:
    """Rides them and prints."""
    options = argparse.ArgumentParser(prog="python -m benchmarks.path_cycles", description=__doc__)
    options.add_argument("--kind", nargs="+", choices=tuple(CLIPS), default=list(CLIPS))
    options.add_argument("--times", nargs="+", type=float, default=list(TIMES))
    chosen = options.parse_args()
    if not Path(DATA / "mocap").is_dir():
        print(f"bench: {DATA} is missing; this benchmark needs its recordings and was skipped")
        return 0
    on_one_core()
    print("\n".join(markdown.head(COLUMNS)))
    notes = []
    for times in chosen.times:
        rides, told = cycles(times, chosen.kind)
        print(line(times, rides, told), flush=True)
        worst = [one for one in rides if len(one.jerk) and one.jerk.max() > 1.005]
        notes += [f"- {times:g}: {one.name}, seam jerk {one.jerk.max():.2f}" for one in worst]
        notes += [f"- {times:g}: {text}" for text in told]
    print("\n".join(["", *notes]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
