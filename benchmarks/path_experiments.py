"""The experiments of the thesis on path editing (chapter 5) with clips of the shipped sample: no recordings are needed.

The simple motion walks straight, the complex one weaves at a jog. Without planting is the method of the thesis.
"""

from __future__ import annotations

import numpy as np

from benchmarks.effort import format_head, format_row
from benchmarks.path_editing import (
    build_hill,
    build_straight,
    build_table,
    flatten_figures,
    measure_cycles,
    measure_edits,
    read_recording,
)
from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.path.arc_length import ArcLength
from beyond_mocap.path_editing.path_edit import edit_path
from beyond_mocap.path_editing.path_edit_settings import PathEditSettings
from beyond_mocap.path_editing.path_edit_source import PathEditSource, prepare_source
from beyond_mocap.path_editing.path_line import fit_line
from beyond_mocap.path_editing.path_metrics import measure_path_edit

SIMPLE, COMPLEX = "walking_1_2", "jogging_weave"
DEGREES = (2, 4, 13, 45)
PATHS = ("straight", "circle 2 m", "zigzag", "eight", "winding", "walkabout")
LENGTHS = (0.5, 2.0)
"""Lengths of the new path over that of the motion's own."""


def list_fits() -> list[tuple[str, PathEditSettings]]:
    """List the paths of a motion that are compared: polynomials by degree, and the spline."""
    fits = [(f"degree {degree}", PathEditSettings(fit="polynomial", degree=degree)) for degree in DEGREES]
    return [*fits, ("spline", PathEditSettings())]


def measure_residual(source: PathEditSource) -> float:
    """Measure how far the hips are from the motion's own path over the ground: the 95th percentile, m."""
    times = np.arange(len(source.motion)) / source.motion.fps
    away = source.motion.root_positions[:, :2] - source.path.at(times)[:, :2]
    return float(np.percentile(np.linalg.norm(away, axis=1), 95))


def build_fit_rows() -> list[str]:
    """Build the rows of figures 5.7 to 5.11, 5.17, 5.18: residuals, and how far the body leaves a line, by degree."""
    rows, line = [], fit_line(build_straight(60.0), "line")
    for clip in (SIMPLE, COMPLEX):
        for name, settings in list_fits():
            source = prepare_source(read_recording("sample", clip), settings)
            aside = np.abs(edit_path(source, line, settings).motion.root_positions[:, 1])
            rows.append(format_row([clip, name, f"{100 * measure_residual(source):.1f}",
                                    f"{100 * np.percentile(aside, 95):.1f}"]))
    return rows


def build_length_rows() -> list[str]:
    """Build the rows of figures 5.2 to 5.4: the speed on a longer and a shorter path, by time and by arc length."""
    rows = []
    for share in LENGTHS:
        for by_arc_length in (False, True):
            settings = PathEditSettings(by_arc_length=by_arc_length)
            source = prepare_source(read_recording("sample", SIMPLE), settings)
            length = share * source.arc.length
            path = fit_line(build_straight(length), "line")
            edited = edit_path(source, path, settings)
            steps = np.linalg.norm(np.diff(edited.motion.root_positions[:, :2], axis=0), axis=1)
            own = np.linalg.norm(np.diff(source.motion.root_positions[:, :2], axis=0), axis=1)
            moving = steps[: int(0.9 * min(1.0, share) * len(steps))]  # on the shorter path it stops halfway
            rows.append(format_row([f"{share:g} times", "arc length" if by_arc_length else "time",
                                    f"{np.median(moving) / np.median(own):.2f}",
                                    f"{ArcLength(path).length:.1f}"]))
    return rows


def build_hill_rows() -> list[str]:
    """Build the rows of figures 5.21 and 5.22: planted soles off a hill of 20 degrees, without planting and with it."""
    rows, path = [], fit_line(build_hill(20.0), "hill")
    for clip in (SIMPLE, COMPLEX):
        for plant in (False, True):
            settings = PathEditSettings(plant=plant)
            source = prepare_source(read_recording("sample", clip), settings)
            try:
                figures = flatten_figures(measure_path_edit(source, edit_path(source, path, settings), path))
            except InputError as error:
                rows.append(format_row([clip, "planted" if plant else "as in the thesis", str(error), "-"]))
                continue
            rows.append(format_row([clip, "planted" if plant else "as in the thesis",
                                    f"{figures['ground_mm.standing_p95']:.1f}",
                                    f"{figures['ground_mm.source_standing_p95']:.1f}"]))
    return rows


def section() -> list[str]:
    """Build the lines for results.md."""
    edits = measure_edits(("sample",), PATHS)
    return [
        *format_head(("clip", "path of the motion", "hips off it cm, p95", "off a line that it follows cm, p95")),
        *build_fit_rows(), "",
        *format_head(("new path", "by", "speed over the own", "length m")), *build_length_rows(), "",
        *build_table(edits, "path"), "", *build_table(edits, "clip"), "",
        *format_head(("clip", "hill of 20 degrees", "planted sole off the ground mm, p95", "own, level")),
        *build_hill_rows(), "", *measure_cycles(("sample",)),
    ]  # fmt: skip
