"""Recordings of many kinds on many paths.

The first ten seconds of each recording follow every path of `ALL`: name -> places (N, 3) m, the first at the origin and
starting along +x. A figure is given beside the recording's own, and beside the same edit without planting where that
says something.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks import effort
from benchmarks.places import CMU_UNIT, DATA, SAMPLE
from beyond_mocap.base.errors import InputError
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion.motion import resample
from beyond_mocap.path_editing.path_edit import edit_path
from beyond_mocap.path_editing.path_edit_settings import PathEditSettings
from beyond_mocap.path_editing.path_edit_source import prepare_source
from beyond_mocap.path_editing.path_line import fit_line
from beyond_mocap.path_editing.path_metrics import measure_path_edit

SECONDS, BUDGET_FRAMES, BUDGET_MS = 10.0, 600, 35.0
CLIPS = {
    "cmu10": ("10_04", "train_walking_1", "train_walking_2", "train_walking_3", "train_running_1", "test_running_1"),
    "lafan1": ("walk1_subject1_walk2_filtered", "walk3_subject4_walk2_filtered", "run2_subject4_run2_filtered",
               "pushAndStumble1_subject2_jog_filtered", "multipleActions1_subject4_walk2_filtered",
               "fightAndSports1_subject1_backward_filtered"),
    "bandai": ("dataset-1_walk_normal_001", "dataset-1_walk_proud_001", "dataset-1_run_normal_001",
               "dataset-1_dash_normal_001", "dataset-1_walk-left_normal_001", "dataset-1_walk-back_normal_001"),
    "runs15": ("sie_humanoid3d_run_forward04", "sie_humanoid3d_run_forward12", "sie_humanoid3d_run_left07"),
    "lmd": ("Player1/P1_S21_dribble_long", "Player1/P1_S27_dribble_straight", "Player1/P1_S01_penalty_kick"),
    "sprinter": ("run0350cms", "run0900cms"),
    "sample": ("walking_1_2", "walk_jog_walk", "jogging_weave", "running_turn_left"),
}  # fmt: skip
RECORDED = tuple(kind for kind in CLIPS if kind != "sample")
COLUMNS = {
    "root error cm, mean / p95": ("root_error_m.mean", "root_error_m.p95"),
    "kept speed off %, path / body": ("kept_speed.path.max", "kept_speed.body.total"),
    "skate cm/s, before -> after (own)": ("skate.before_contact_cm_s", "skate.contact_cm_s",
                                          "skate.source_contact_cm_s"),
    "all planted points": ("skate.before_point_cm_s", "skate.point_cm_s", "skate.source_point_cm_s"),
    "stance mm (own)": ("skate.stance_mm_median", "skate.source_stance_mm_median"),
    "over 21 mm % (own)": ("skate.stances_over_21mm", "skate.source_stances_over_21mm"),
    "IK missed %": ("ik_miss_share",),
    "foot moved cm, p95": ("foot_correction_m.p95",),
    "knee jerk / own": ("knee_jerk_ratio.p99",),
    "sole off mm, p95 (own)": ("ground_mm.standing_p95", "ground_mm.source_standing_p95"),
}


STEP = 0.02  # m between places


def build_straight(length: float = 30.0) -> np.ndarray:
    """Build a straight line."""
    return np.column_stack([np.arange(0.0, length, STEP), *np.zeros((2, len(np.arange(0.0, length, STEP))))])


def build_circle(radius: float, rounds: float = 1.0) -> np.ndarray:
    """Build a circle to the left."""
    return build_curve(lambda s: np.full_like(s, 1.0 / radius), 2.0 * np.pi * radius * rounds)


def build_curve(curvature, length: float) -> np.ndarray:
    """Build the line whose curvature, 1/m to the left, is curvature(s (N,) m)."""
    s = np.arange(0.0, length, STEP)
    bend = curvature(s)
    heading = np.concatenate([[0.0], np.cumsum(0.5 * STEP * (bend[1:] + bend[:-1]))])
    middle = 0.5 * (heading[1:] + heading[:-1])
    steps = STEP * np.column_stack([np.cos(middle), np.sin(middle)])
    return np.column_stack([np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]), np.zeros(len(s))])


def build_winding(radius: float = 2.5, wave: float = 9.0, length: float = 30.0) -> np.ndarray:
    """Build a row of S curves; `radius` m at the tightest points."""
    return build_curve(lambda s: np.sin(2.0 * np.pi * s / wave) / radius, length)


def build_zigzag(leg: float = 3.0, angle: float = 60.0, legs: int = 10) -> np.ndarray:
    """Build straight legs that turn by `angle` degrees to and fro: corners only."""
    heading = np.radians(angle) * (np.arange(legs) % 2)
    steps = leg * np.column_stack([np.cos(heading), np.sin(heading), np.zeros(legs)])
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def build_eight(size: float = 3.5, rounds: float = 1.5) -> np.ndarray:
    """Build a figure of eight (Gerono's), 2 `size` m long."""
    t = np.linspace(0.0, 2.0 * np.pi * rounds, 3000)
    line = size * np.column_stack([np.sin(t), np.sin(t) * np.cos(t), np.zeros_like(t)])
    return line @ _rotation_matrix(-0.25 * np.pi)


def build_walkabout(length: float = 30.0, seed: int = 3, tightest: float = 2.0) -> np.ndarray:
    """Build a walk with bends of all sizes, radius at least `tightest` m."""
    rng = np.random.default_rng(seed)
    waves, phases, size = rng.uniform(5.0, 16.0, 5), rng.uniform(0.0, 2.0 * np.pi, 5), rng.uniform(0.4, 1.0, 5)
    s = np.arange(0.0, length, STEP)
    bend = np.sum(size * np.sin(2.0 * np.pi * s[:, None] / waves + phases), axis=1)
    return build_curve(lambda at: np.interp(at, s, bend / np.abs(bend).max() / tightest), length)


def build_hill(degrees: float, distance: float = 4.0, length: float = 30.0) -> np.ndarray:
    """Build hills: up for `distance` m over the ground, over the top and down again, and so on.

    Slopes are `degrees` except for 1 m around tops and valleys.
    """
    line = build_straight(length)
    slope = np.tan(np.radians(degrees)) * np.clip(np.sin(np.pi * line[:, 0] / distance) * distance / np.pi, -1.0, 1.0)
    line[:, 2] = np.cumsum(slope) * STEP
    return line


def _rotation_matrix(angle: float) -> np.ndarray:
    """Return the matrix that rotates rows about the vertical by `angle` rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


FAIR = {"straight": build_straight(), "circle 8 m": build_circle(8.0), "circle 3 m": build_circle(3.0, 2.0),
        "circle 2 m": build_circle(2.0, 3.0), "winding": build_winding(), "walkabout": build_walkabout()}
TIGHT = {"eight": build_eight(), "zigzag": build_zigzag(), "circle 1 m": build_circle(1.0, 5.0)}
HILLS = {f"hill {degrees}": build_hill(degrees) for degrees in (5, 10, 15)}
ALL = {**FAIR, **TIGHT, **HILLS}


@dataclass(frozen=True)
class EditRow:
    """One path edit.

    Attributes:
        kind: kind of recording.
        clip: the recording.
        path: name of the path.
        values: figures by dotted name.
        ms: of `edit_path`.
    """

    kind: str
    clip: str
    path: str
    values: dict[str, float]
    ms: float


def measure_edits(kinds: Iterable[str] = RECORDED, paths: Iterable[str] = tuple(ALL), **settings) -> list[EditRow]:
    """Measure each recording of `kinds` on each of `paths`.

    Args:
        kinds: keys of CLIPS.
        paths: keys of ALL.
        settings: of `PathEditSettings`.
    """
    edit_settings, rows = PathEditSettings(**settings), []
    for kind in kinds:
        for name in CLIPS[kind]:
            source = prepare_source(read_recording(kind, name), edit_settings)
            rows += [_build_row(kind, name, path, source, edit_settings) for path in paths]
    return rows


def read_recording(kind: str, name: str):
    """Read the first ten seconds of a recording."""
    file = (SAMPLE / "library" if kind == "sample" else DATA / "mocap" / kind) / f"{name}.bvh"
    motion = bvh.read_bvh(file, CMU_UNIT if kind == "cmu10" else None).motion
    return motion.frames(0, min(len(motion), int(SECONDS * motion.fps) + 1))


def _build_row(kind: str, name: str, shape: str, source, settings: PathEditSettings) -> EditRow:
    """Edit and measure one recording on one path."""
    path = fit_line(ALL[shape], shape)
    started = time.process_time()
    edited = edit_path(source, path, settings)
    took = 1e3 * (time.process_time() - started)
    return EditRow(kind, name, shape, flatten_figures(measure_path_edit(source, edited, path)), took)


def flatten_figures(value, name: str = "") -> dict[str, float]:
    """Flatten nested figures to dotted names; what is not known is NaN."""
    if isinstance(value, dict):
        return {
            k: v for key, entry in value.items() for k,
            v in flatten_figures(entry, f"{name}.{key}" if name else key).items()
        }
    return {name: np.nan if value is None else float(value)}


def build_table(rows: list[EditRow], by: str) -> list[str]:
    """Build a table of medians over the edits of each `by` (kind or path)."""
    names = list(dict.fromkeys(getattr(row, by) for row in rows))
    lines = effort.format_head([by, "edits", *COLUMNS])
    for name in names:
        group = [row for row in rows if getattr(row, by) == name]
        lines.append(effort.format_row([name, str(len(group)), *(_format_cell(group, of) for of in COLUMNS.values())]))
    return lines


def _format_cell(group: list[EditRow], names: tuple[str, ...]) -> str:
    """Format the median of one to three figures."""
    values = [_figure_scale(name) * _finite_median([row.values.get(name, np.nan) for row in group]) for name in names]
    texts = ["-" if not np.isfinite(value) else f"{value if abs(value) > 1e-6 else 0.0:.3g}" for value in values]
    if len(texts) == 3:
        return f"{texts[0]} -> {texts[1]} ({texts[2]})"
    own = len(texts) == 2 and "source" in names[1]
    return f"{texts[0]} ({texts[1]})" if own else " / ".join(texts)


def _figure_scale(name: str) -> float:
    """Return the factor to centimetres or percent of a figure."""
    if "_m." in name:
        return 100.0
    return 100.0 if name.startswith("kept_speed") or "share" in name or "over_21" in name else 1.0


def _finite_median(values: list[float]) -> float:
    """Compute the median of finite values, NaN without any."""
    known = [value for value in values if np.isfinite(value)]
    return float(np.median(known)) if known else np.nan


WORST = {
    "root error mean, cm": lambda v: 100.0 * v["root_error_m.mean"],
    "kept speed off, %": lambda v: 100.0 * v["kept_speed.path.max"],
    "skate over the recording's own, cm/s": lambda v: v["skate.contact_cm_s"] - v["skate.source_contact_cm_s"],
    "planted points over the recording's own, cm/s": lambda v: v["skate.point_cm_s"] - v["skate.source_point_cm_s"],
    "stance over the recording's own, mm": lambda v: v["skate.stance_mm_median"] - v["skate.source_stance_mm_median"],
    "frames in which IK missed, %": lambda v: 100.0 * v["ik_miss_share"],
    "foot moved, p95, cm": lambda v: 100.0 * v["foot_correction_m.p95"],
    "knee jerk over the recording's own": lambda v: v["knee_jerk_ratio.p99"],
    "planted sole off the surface over the recording's own, p95, mm": (
        lambda v: v["ground_mm.standing_p95"] - v["ground_mm.source_standing_p95"]
    ),
}


def list_worst(rows: list[EditRow], count: int) -> list[str]:
    """List the `count` worst edits for every kind of figure."""
    lines = []
    for title, of in WORST.items():
        known = [(value, row) for row in rows if np.isfinite(value := _figure_value(of, row))]
        first = sorted(known, key=lambda pair: -pair[0])[:count]
        text = "; ".join(f"{row.kind}/{row.clip} on {row.path} {value:.2g}" for value, row in first)
        lines.append(f"- {title}: {text}")
    return lines


def _figure_value(of, row: EditRow) -> float:
    """Return a figure of a row, NaN where it lacks one."""
    try:
        return of(row.values)
    except KeyError:
        return np.nan


def describe_fair_paths(rows: list[EditRow]) -> str:
    """Describe how many edits on fair paths skate no more than their recording, and keep the speed."""
    fair = [row for row in rows if row.path in FAIR]
    if not fair:
        return "no edit on a fair path"
    pairs = [(row.values.get("skate.contact_cm_s"), row.values.get("skate.source_contact_cm_s")) for row in fair]
    known = [(a, b) for a, b in pairs if a is not None and np.isfinite(a) and np.isfinite(b)]
    still = np.mean([a <= b + 0.05 for a, b in known])
    speed = np.mean([row.values["kept_speed.path.max"] <= 0.01 for row in fair])
    error = np.mean([row.values["root_error_m.mean"] <= 0.005 for row in fair])
    return (
        f"Bends of radius 2 m or more, {len(fair)} edits: feet slide no more than in the recording in {still:.0%}, arc "
        f"length per frame is kept within 1 % in {speed:.0%}, the root is within 5 mm of the path (mean) in "
        f"{error:.0%}."
    )


def measure_timing() -> str:
    """Measure ms of `prepare_source` and `edit_path` for 600 frames at 60 per second, the best of seven."""
    motion = read_recording("lafan1", "walk1_subject1_walk2_filtered")
    motion = resample(motion, 60.0).frames(0, BUDGET_FRAMES)
    settings, path = PathEditSettings(), fit_line(build_winding(), "winding")
    took = {"prepare": np.inf, "edit": np.inf, "edit without planting": np.inf}
    for _ in range(7):
        started = time.process_time()
        source = prepare_source(motion, settings)
        ready = time.process_time()
        edit_path(source, path, settings)
        done = time.process_time()
        edit_path(source, path, replace(settings, plant=False))
        for name, ms in zip(took, (ready - started, done - ready, time.process_time() - done)):
            took[name] = min(took[name], 1e3 * ms)
    text = ", ".join(f"{name} {ms:.0f} ms" for name, ms in took.items())
    return f"{len(motion)} frames, {len(motion.skeleton)} joints: {text} (target of an edit: {BUDGET_MS:g} ms)."


def measure_cycles(kinds: Iterable[str] = RECORDED) -> list[str]:
    """Measure jerk at the transitions of recordings cycled along 25 m of the winding path, a line per kind."""
    lines = ["Cycled on the winding path, jerk at transitions over the recording's own at that speed (95th "
             "percentile):", ""]
    for kind in kinds:
        ratios, texts = [], []
        for name in CLIPS[kind]:
            source = prepare_source(read_recording(kind, name), PathEditSettings())
            try:
                row = _build_row(kind, name, "winding", source, PathEditSettings(cycle=True))
            except InputError as error:
                texts.append(f"{name}: {error}")
                continue
            if np.isfinite(row.values["seam_jerk.max"]):
                ratios.append(row.values["seam_jerk.max"])
                texts.append(f"{name} {ratios[-1]:.2f}")
        most = f"{np.median(ratios):.2f} median, {max(ratios):.2f} largest" if ratios else "no transitions"
        lines.append(f"- {kind}: {most} ({'; '.join(texts)})")
    return [*lines, ""]


def section(kinds: Iterable[str] = RECORDED, paths: Iterable[str] = tuple(ALL), count: int = 3) -> list[str]:
    """Build the lines of a report: what is kept, by path, by recordings, the worst `count`, cycling."""
    rows = measure_edits(kinds, paths)
    return [describe_fair_paths(rows), "", measure_timing(), "", *build_table(rows, "path"), "",
            *build_table(rows, "kind"), "", "Medians; `before` is without planting, `own` the recording's. The worst:",
            "", *list_worst(rows, count), "", *measure_cycles(kinds)]
