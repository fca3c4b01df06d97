"""The path-editing document's chapter 5 with real clips: `python -m benchmarks.path_experiments [--only NAME ...]`.

Writes docs/pictures/path-*.png, each with the skate of its feet before and after planting, and prints all figures.
Clips: cmu10 alone. `simple` is train_walking_3, a straight walk; `complex`, of which cmu10 has none, is synthesized
from cmu10's clips along a winding track.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from beyond_mocap.base.time_series import interpolate
from beyond_mocap.base.vectors import distance_along, unit_vector
from beyond_mocap.annotation import Timeline
from beyond_mocap.evaluation import jerk
from beyond_mocap.evaluation.path_ride import figures
from beyond_mocap.files import bvh
from beyond_mocap.library.build import build
from beyond_mocap.motion.arc_length import ArcLength
from beyond_mocap.motion.motion import Motion, forward_kinematics
from beyond_mocap.motion.track import Track
from beyond_mocap.plan import Plan
from beyond_mocap.polish.path_frame import moving_frame, placed
from beyond_mocap.polish.path_line import through
from beyond_mocap.ride import Ridden, RideSettings, RideSource, prepare, ride
from beyond_mocap.synthesize import synthesize

from benchmarks import path_shapes, path_plots as plots
from benchmarks.path_plots import NEW, OLD, PATH, RIGID
from benchmarks.places import CMU_UNIT, DATA, ROOT

PICTURES = ROOT / "docs" / "pictures"
DEGREES = (2, 4, 13, 45)
SHAPES = {
    "circle, radius 2 m": path_shapes.circle(2.0), "zigzag": path_shapes.zigzag(legs=5),
    "figure of eight": path_shapes.eight(2.8, 1.0), "walkabout": path_shapes.walkabout(16.0, seed=8, tightest=1.0),
}  # fmt: skip
SIMPLE, RUN = "train_walking_3", "train_running_1"
WALK_SPEED = 1.15
AS_PAPER = {"plant": False, "lean": False, "slopes": False}


@cache
def clip(name: str) -> Motion:
    """A recording of cmu10."""
    return bvh.read(DATA / "mocap" / "cmu10" / f"{name}.bvh", CMU_UNIT).motion


@cache
def complex_motion() -> tuple[Motion, np.ndarray]:
    """Clips of cmu10 along a winding track, and which points of its feet stand."""
    line = path_shapes.walkabout(22.0, seed=8, tightest=0.8)
    times = np.arange(len(line)) * path_shapes.STEP / WALK_SPEED
    track = Track(times[::6], line[::6, :2], np.full((len(times[::6]), 3), np.nan), name="winding")
    with tempfile.TemporaryDirectory() as folder:
        library = build(DATA / "mocap" / "cmu10", unit=CMU_UNIT, cache_dir=folder)
        take = synthesize(library, Plan(track=track, timeline=Timeline(), library=str(library.folder), fps=60.0))
    return take.motion, np.repeat(take.contacts[:, :, None], 2, axis=2)


def source_of(name: str, settings: RideSettings) -> RideSource:
    """A recording, or `complex`, taken off its own path."""
    if name == "complex":
        motion, standing = complex_motion()
        return prepare(motion, settings, standing=standing)
    return prepare(clip(name), settings)


@dataclass(frozen=True)
class Trial:
    """One ride and its figures."""

    source: RideSource
    ridden: Ridden
    told: dict
    planted: bool

    @property
    def feet(self) -> str:
        """What is written under its picture."""
        skate = self.told["skate"]
        if not self.planted:
            return f"feet slide {skate['contact_cm_s']:.1f}, {skate['source_contact_cm_s']:.1f} cm/s recorded"
        return (
            f"feet slide {skate['before_contact_cm_s']:.1f} rigid, {skate['contact_cm_s']:.1f} planted, "
            f"{skate['source_contact_cm_s']:.1f} cm/s recorded"
        )


def tried(name: str, line: np.ndarray | None, ground=None, **settings) -> Trial:
    """A recording on a line (N, 3) m, None for its own path."""
    chosen = RideSettings(**settings)
    source = source_of(name, chosen)
    path = source.path if line is None else through(line, "line")
    ridden = ride(source, path, chosen, ground)
    return Trial(source, ridden, {**figures(source, ridden, path, ground), "path": path}, chosen.plant)


def say(name: str, trial: Trial) -> None:
    """A line of figures."""
    told = trial.told
    print(
        f"  {name}: {len(trial.ridden.motion)} frames, {told['length_m']:.1f} m, {trial.feet}; stance "
        f"{told['skate']['stance_mm_median']:.1f} mm; root {100 * told['root_error_m']['mean']:.1f} cm; soles off "
        f"{told['ground_mm']['standing_p95']:.0f} mm p95; knee jerk {told['knee_jerk_ratio']['p99']:.2f} of its own"
    )


def degrees():
    """Figure 5.7: the path of the complex motion by polynomials of four degrees, and by the spline."""
    figure, axes = plots.canvas(1, 5, tall=2.9, sharex=True, sharey=True)
    for ax, degree in zip(axes[0], (*DEGREES, None)):
        source = source_of("complex", _fit(degree))
        plots.way(ax, source.motion, OLD, "motion", every=1e9)
        plots.curve(ax, source.path, "path")
        off = 100.0 * _residual(source)[:, :2]
        plots.from_above(ax, _named(degree), f"residual {np.linalg.norm(off, axis=1).mean():.1f} cm mean")
        print(f"  {_named(degree)}: residual {np.linalg.norm(off, axis=1).mean():.2f} cm mean")
    plots.legend(axes[0, 0], loc="upper right")
    return figure


def residuals():
    """Figures 5.8 to 5.11: how far the motion is from its path, over time."""
    figure, axes = plots.canvas(1, 5, tall=2.6, sharex=True)
    for ax, degree in zip(axes[0], (*DEGREES, None)):
        source = source_of("complex", _fit(degree))
        off, times = 100.0 * _residual(source), np.arange(len(source.motion)) / source.motion.fps
        for axis, name in enumerate(("x", "y")):
            ax.plot(times, off[:, axis], linewidth=0.9, label=name)
        ax.set_title(_named(degree), fontsize=9)
        ax.set_xlabel("s", fontsize=8)
        ax.tick_params(labelsize=7)
        ax.grid(True, linewidth=0.3)
    axes[0, 0].set_ylabel("residual, cm", fontsize=8)
    plots.legend(axes[0, 0])
    return figure


def _fit(degree: int | None) -> RideSettings:
    return RideSettings(fit="polynomial", degree=degree) if degree else RideSettings()


def _named(degree: int | None) -> str:
    return f"degree {degree}" if degree else "spline (ours)"


def _residual(source: RideSource) -> np.ndarray:
    """(T, 3) m from the path to the root, in the world."""
    return source.motion.root_positions - source.path.at(np.arange(len(source.motion)) / source.motion.fps)


def lengths():
    """Figures 5.1 to 5.4: paths of twice and half the length, by time and by arc length."""
    figure, axes = plots.canvas(5, 1, tall=2.1, sharex=True, sharey=True)
    own = tried(SIMPLE, None, plant=False, lean=False)
    length = own.told["length_m"]
    rows = [("the recording", own)]
    for title, share in (("path twice as long", 2.0), ("path half as long", 0.5)):
        line = path_shapes.straight(share * length)
        rows.append((f"{title}, by time", tried(SIMPLE, line, by_arc_length=False)))
        rows.append((f"{title}, by arc length", tried(SIMPLE, line)))
    for ax, (title, trial) in zip(axes[:, 0], rows):
        _level(ax, trial, OLD if trial is own else NEW)
        speed = trial.told["length_m"] / trial.ridden.motion.duration
        slides = "" if trial is own else f"; {trial.feet}"
        ax.set_title(f"{title}: {speed:.2f} m/s{slides}", fontsize=9)
        say(title, trial)
    axes[-1, 0].set_xlabel("m", fontsize=8)
    return figure


def _level(ax, trial: Trial, colour: str, every: float = 0.5) -> None:
    """Stick figures from the side, every half second, set out along +x."""
    motion = trial.ridden.motion
    way = motion.root_positions[-1, :2] - motion.root_positions[0, :2]
    way = unit_vector(way)
    straight = replace(motion, root_positions=motion.root_positions - [*motion.root_positions[0, :2], 0.0])
    plots.sticks(ax, straight, np.arange(0, len(motion), round(every * motion.fps)), colour, way)
    plots.from_the_side(ax)


def ends():
    """Figure 5.5: a path shorter than the motion, which stops there or begins again."""
    figure, axes = plots.canvas(1, 2, tall=2.4, sharey=True)
    line = path_shapes.straight(2.6)
    for ax, end in zip(axes[0], ("stop", "repeat")):
        trial = tried(SIMPLE, line, end=end)
        times = np.arange(len(trial.ridden.motion)) / trial.ridden.motion.fps
        ax.plot(times, trial.ridden.arc, color=PATH, linewidth=1.0, label="on the path")
        ax.plot(times, trial.ridden.motion.root_positions[:, 0], color=NEW, linewidth=1.3, label="pelvis")
        ax.axhline(2.6, color="grey", linewidth=0.6, linestyle=":")
        ax.set_title(f"end: {end}", fontsize=9)
        ax.set_xlabel("s", fontsize=8)
        ax.tick_params(labelsize=7)
        say(f"end {end}", trial)
    axes[0, 0].set_ylabel("m along the path", fontsize=8)
    plots.legend(axes[0, 0])
    return figure


def cycling():
    """Figure 5.6: the walk over and over, by jumping back to its first frame (eq. 4.5), and by our loop."""
    figure, axes = plots.canvas(2, 2, tall=2.6, sharex="row", sharey="row")
    line = path_shapes.straight(9.0)
    ours = tried(SIMPLE, line, cycle=True)
    crude, seams = _jumped(ours.source, ours.told["path"], len(ours.ridden.motion))
    kinds = (("as in the paper", crude, seams, RIGID), ("ours", ours.ridden.motion, ours.ridden.seams, NEW))
    for number, (title, motion, seams, colour) in enumerate(kinds):
        values = jerk.jerk(forward_kinematics(motion)[0], motion.fps)
        moments = int(seams[0]) + np.arange(-4, 5, 2)
        plots.sticks(axes[0, number], _at_home(motion, int(seams[0])), moments, colour, spread=0.55)
        axes[0, number].set_title(f"{title}: five moments over the first seam, 17 ms apart", fontsize=9)
        plots.from_the_side(axes[0, number])
        axes[1, number].plot(np.arange(len(values)) / motion.fps, values, color=colour, linewidth=0.8)
        axes[1, number].set_yscale("log")
        axes[1, number].set_xlabel("s", fontsize=8)
        axes[1, number].tick_params(labelsize=7)
        at = [int(seam) for seam in seams if seam < len(values) - 8]
        most = max(values[seam - 8 : seam + 8].max() for seam in at)
        print(f"  {title}: largest jerk at a seam {most:.0f} m/s^3")
    axes[1, 0].set_ylabel("largest jerk of a joint, m/s^3", fontsize=8)
    say("ours", ours)
    return figure


def _at_home(motion: Motion, frame: int) -> Motion:
    """The motion with the pelvis of one frame over 0."""
    return replace(motion, root_positions=motion.root_positions - motion.root_positions[frame] * [1.0, 1.0, 0.0])


def _jumped(source: RideSource, path, count: int) -> tuple[Motion, np.ndarray]:
    """`count` frames of a motion that jumps back to its first frame after its last, and the frames where it does."""
    at = np.arange(count) % len(source.motion)
    own = np.cumsum(source.residuals.step)
    arc = own[at] + own[-1] * (np.arange(count) // len(source.motion))
    u = ArcLength(path).parameter(arc)
    moving = moving_frame(path.at(u), path.at(u, 1), arc, source.motion.fps)
    root, rotations = placed(source.frame, moving, source.residuals.place[at], source.residuals.rotations[at])
    return replace(source.motion, root_positions=root, rotations=rotations), np.flatnonzero(at == 0)[1:]


def complexes():
    """Figures 5.12 to 5.16: the simple walk in a circle, a zigzag, an eight, and walkabout."""
    figure, axes = plots.canvas(2, 2, tall=4.2)
    for ax, (name, line) in zip(axes.ravel(), SHAPES.items()):
        trial = tried(SIMPLE, line, cycle=True)
        _prints(ax, trial)
        plots.from_above(ax, name, trial.feet)
        say(name, trial)
    plots.legend(axes[0, 0], loc="center")
    return figure


def walkers():
    """The same rides as bodies."""
    figure, axes = plots.canvas(1, 4, tall=2.9)
    for ax, (name, line) in zip(axes[0], SHAPES.items()):
        ridden = tried(SIMPLE, line, cycle=True).ridden
        frames = np.searchsorted(ridden.arc, np.arange(0.0, ridden.arc[-1], 1.05))
        plots.photo(ax, plots.bodies(ridden.motion, frames, -70.0, size=300, tilt=1.2), name)
    return figure


def footprint():
    """A piece of the circle from near by: standing feet, rigid and planted."""
    figure, axes = plots.canvas(1, 3, tall=3.6)
    trial = tried(SIMPLE, path_shapes.circle(2.0), cycle=True)
    shown = (
        ("recorded", trial.source.motion, trial.source.standing, OLD),
        ("ridden rigidly", trial.ridden.rigid, trial.ridden.standing, RIGID),
        ("planted", trial.ridden.motion, trial.ridden.standing, NEW),
    )
    skate = trial.told["skate"]
    for ax, (title, motion, standing, colour), kind in zip(axes[0], shown, ("source_", "before_", "")):
        upto = round(3.0 * motion.fps)
        plots.footprints(ax, motion.frames(0, upto), standing[:upto], colour, "feet", wide=1.4)
        ax.plot(*motion.frames(0, upto).root_positions[:, :2].T, color=PATH, linewidth=0.7)
        plots.from_above(
            ax, title, f"{skate[f'{kind}contact_cm_s']:.1f} cm/s, {skate[f'{kind}stance_mm_median']:.0f} mm in a stance"
        )
    return figure


def _prints(ax, trial: Trial) -> None:
    """A ride from above: its path, its pelvis with a dot every second, and its standing feet."""
    plots.curve(ax, trial.told["path"], "path")
    plots.way(ax, trial.ridden.motion, NEW, "pelvis", every=1.0)
    plots.footprints(ax, trial.ridden.motion, trial.ridden.standing, RIGID, "standing feet")


def _cut(line: np.ndarray, length: float) -> np.ndarray:
    along = distance_along(line)
    ends = interpolate(length, along, line)
    return np.concatenate([line[along < length], ends[None]]) if along[-1] > length else line


def bends():
    """A run in a bend as bodies: rigid and upright as in the paper, and planted and leaning."""
    figure, axes = plots.canvas(1, 2, tall=5.0)
    for ax, (title, more) in zip(axes[0], (("as in the paper", AS_PAPER), ("planted, leaning into the bend", {}))):
        trial = tried(RUN, _cut(path_shapes.circle(3.0), 4.0), **more)
        frames = np.linspace(0, len(trial.ridden.motion) - 1, 6).astype(int)
        plots.photo(ax, plots.bodies(trial.ridden.motion, frames, 110.0, size=480, wide=5.0), title, trial.feet)
        say(title, trial)
    return figure


def straightened():
    """Figures 5.17 and 5.18: the complex motion on a straight line, by the degree of its own path."""
    figure, axes = plots.canvas(5, 1, tall=1.6, sharex=True, sharey=True)
    line = path_shapes.straight(20.0)
    for ax, degree in zip(axes[:, 0], (*DEGREES, None)):
        more = {"fit": "polynomial", "degree": degree} if degree else {}
        trial = tried("complex", line, **more)
        _prints(ax, trial)
        off = 100.0 * np.abs(trial.ridden.motion.root_positions[:, 1]).mean()
        plots.from_above(ax, f"{_named(degree)}: {off:.0f} cm beside the line; {trial.feet}")
        say(_named(degree), trial)
    return figure


def rerouted():
    """Figures 5.19 and 5.20: the complex motion on other complex paths."""
    figure, axes = plots.canvas(1, 2, tall=4.6)
    lines = {"figure of eight": path_shapes.eight(2.8, 1.0),
             "one bend after the other": path_shapes.winding(length=20.0)}
    for ax, (name, line) in zip(axes[0], lines.items()):
        trial = tried("complex", line)
        _prints(ax, trial)
        plots.from_above(ax, name, trial.feet)
        say(name, trial)
    plots.legend(axes[0, 1], loc="upper left")
    return figure


def hills():
    """Figures 5.21 and 5.22: uphill and downhill, the body relative to the path's level tangent, to its full one, and
    with its feet on the surface."""
    figure, axes = plots.canvas(3, 1, tall=2.5, sharex=True, sharey=True)
    line = path_shapes.hill(20.0, way=3.0, length=6.0)
    rows = (
        ("level tangent (the paper's): a lift", AS_PAPER),
        ("full tangent (the paper's other): falling", {**AS_PAPER, "frame": "tangent"}),
        ("ours: level tangent, feet on the surface", {}),
    )
    for ax, (title, more) in zip(axes[:, 0], rows):
        trial = tried(SIMPLE, line, cycle=True, **more)
        ax.plot(line[:, 0], line[:, 2], color=PATH, linewidth=1.2)
        plots.sticks(ax, trial.ridden.motion, _standing_frames(trial), NEW if not more else RIGID)
        soles = trial.told["ground_mm"]["standing_p95"]
        ax.set_title(f"{title}: standing soles {soles:.0f} mm off the ground (95 %); {trial.feet}", fontsize=9)
        plots.from_the_side(ax)
        say(title, trial)
    axes[-1, 0].set_xlabel("m", fontsize=8)
    return figure


def _standing_frames(trial: Trial) -> np.ndarray:
    """Frames at least 0.6 m apart in which a foot stands and ought to be on the ground."""
    stands = trial.ridden.standing.all(axis=2).any(axis=1)
    frames = []
    for frame in np.flatnonzero(stands):
        if not frames or trial.ridden.arc[frame] - trial.ridden.arc[frames[-1]] > 0.6:
            frames.append(frame)
    return np.array(frames)


EXPERIMENTS: dict[str, Callable] = {
    "degrees": degrees, "residuals": residuals, "lengths": lengths, "ends": ends, "cycling": cycling,
    "complex": complexes, "walkers": walkers,
    "footprints": footprint, "bends": bends,
    "straightened": straightened, "rerouted": rerouted, "hills": hills,
}  # fmt: skip


def main() -> int:
    """Makes all pictures, or those that are asked for."""
    options = argparse.ArgumentParser(prog="python -m benchmarks.path_experiments", description=__doc__)
    options.add_argument("--only", nargs="+", choices=tuple(EXPERIMENTS), default=list(EXPERIMENTS))
    options.add_argument("--out", type=Path, default=PICTURES)
    chosen = options.parse_args()
    if not (DATA / "mocap" / "cmu10").is_dir():
        print(f"path experiments: {DATA} is missing; they need its recordings and were skipped")
        return 0
    for name in chosen.only:
        print(name)
        plots.saved(EXPERIMENTS[name](), chosen.out / f"path-{name}.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
