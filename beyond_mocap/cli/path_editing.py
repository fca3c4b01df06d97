"""The verb `path`: a recording follows another path and keeps its distance from bodies that already move.

To keep the distance it waits or takes a detour, as little as possible.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.errors import InputError
from ..base.settings.options import add_options, option_values, parse_path
from .outputs import ProgressReporter, Writer, build_take, check_outputs, choose_writer, locate_errors

if TYPE_CHECKING:
    from ..path_editing.detour import Follower, PathChange
    from ..path_editing.path_edit import EditedMotion
    from ..path_editing.path_edit_settings import PathEditSettings
    from ..path_editing.path_edit_source import PathEditSource

_MAX_ROUNDS = 3  # searches for delays and detours at most
_RAISED = 0.03  # metres of toes above the ground, beyond those of a synthetic gait, from which on takes differ visibly
_HIP_HEIGHT = 0.9  # metres, rough height of hips above the ground; only decides whether bodies are on one floor


def add_path(verbs):
    """Add the verb `path`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("path", help="move a recording onto another path")
    verb.add_argument("input", type=parse_path, metavar="IN.bvh", help="the motion")
    verb.add_argument("--path", type=parse_path, required=True, metavar="CURVE.csv", help="x_m,y_m[,z_m]: the new path")
    verb.add_argument("--out", type=parse_path, required=True, metavar="OUT.bvh", help="the motion on the path")
    # Blender's Cycles add-on reads the arguments after `--` (batch.py) and quits over `--cycle`: hence the alias --loop
    add_options(verb, "path_editing")
    verb.set_defaults(run=run_path)
    return verb


def run_path(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `path`: move the recording onto the path and write the requested files.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    import numpy as np

    from ..files.bvh import bvh

    started = time.perf_counter()
    inputs = (options.input, options.path, options.ground, *options.avoid)
    check_outputs(options.out, options.report, options.provenance, reserved=inputs)
    write = choose_writer(options.out, writers)
    if options.control_degree and not options.control_points:
        raise InputError("--control-degree", "set without --control-points", "both", "add --control-points")
    if options.distance and not options.avoid:
        raise InputError("--distance", "set without --avoid", "both", "add --avoid OTHER.bvh")
    if options.closed and options.control_points:
        raise InputError("--closed", "set with --control-points", "one of them", "remove one: a B-spline is open")
    path, ground = _read_path(options), _read_ground(options)
    clip = bvh.read_bvh(options.input, options.unit)
    loaded = time.perf_counter()
    reporter.check_cancelled()
    reporter.show_progress(0.2, "Fitting the original path")
    source, settings = _prepare_source(clip.motion, options)
    settings, changes = _avoid_others(source, path, settings, ground, options)
    reporter.check_cancelled()
    reporter.show_progress(0.5, "Moving onto the path")
    edited, take = _edit_motion(source, path, settings, ground, options)
    done = time.perf_counter()
    take.seconds.update(load=loaded - started, construct=done - loaded, total=done - started)
    reporter.check_cancelled()
    report = _build_report(source, edited, take, path, ground) if options.report else None
    reporter.check_cancelled()
    notes = [f"{options.input}: {note}" for note in (*clip.notes, *_describe_raised_toes(source, path, ground))]
    if options.out.suffix.lower() == ".bvh":
        notes += [f"{options.out}: {note}" for note in bvh.write_bvh(options.out, edited.motion, clip.form)]
    else:
        write(take, options.out)
    _write_tables(options, take, report)
    reporter.finish((*notes, *changes, *edited.warnings))
    distance = float(np.maximum(np.diff(edited.arc), 0.0).sum())  # a repeated path starts again at 0
    print(f"{options.out}: {len(edited.motion)} frames, {edited.motion.duration:.1f} s, {distance:.1f} "
          f"m{_describe_unit(clip, options)}")


def _describe_raised_toes(source, path, ground) -> list[str]:
    """Report where the toes of flat feet are above the path, as in some recordings: in takes they are on the ground."""
    from ..motion.contacts import measure_sole_height

    raised = source.sole - measure_sole_height(source.motion.skeleton) if source.has_legs else 0.0
    lowered = max(-float(path.coefficients[:, 2].min()), 0.0)
    if raised - lowered < _RAISED or ground is not None:
        return []
    return [f"toes of flat feet are {100.0 * raised:.1f} cm above the ground, as recorded; in takes they are on it: "
            f"with z_m {-raised:.3f} in the path they are here too"]


def _describe_unit(clip, options) -> str:
    """Describe the output's unit where it differs from the input's."""
    import numpy as np

    same = options.out.suffix.lower() != ".bvh" or np.isclose(clip.form.unit, 0.01)
    return "" if same else "; positions in centimetres (--unit 0.01)"


def _write_tables(options, take, report: dict | None) -> None:
    from ..files.tables import write_report
    from ..synthesis.provenance import write_provenance

    if options.provenance:
        write_provenance(options.provenance, take)
    if report is not None:
        write_report(options.report, report)


def _read_path(options):
    """Read the new path."""
    from ..path_editing import path_line
    from ..path_editing.path_line import read_curve

    points = read_curve(options.path)
    with locate_errors(options.path):
        if options.control_points:
            return path_line.build_b_spline(points, options.control_degree or 3)
        return path_line.fit_line(points, str(options.path), closed=options.closed)


def _read_ground(options):
    """Read the ground mesh; None for the path's own height."""
    if options.ground is None:
        return None
    from ..files.obj import read_mesh
    from ..motion.path.terrain import Terrain

    return Terrain(*read_mesh(options.ground))


def _prepare_source(motion, options):
    """Separate the recording from its own path; return it with the settings."""
    from ..path_editing.path_edit_settings import PathEditSettings
    from ..path_editing.path_edit_source import prepare_source

    settings = PathEditSettings(
        fit="polynomial" if options.degree else "spline", **option_values(PathEditSettings, options, "path_editing")
    )
    with locate_errors(options.input):
        return prepare_source(motion, settings), settings


def _avoid_others(source, path, settings, ground, options):
    """Add delays and detours that avoid other bodies; return the settings and a line for each change."""
    if not options.avoid:
        return settings, ()
    from ..path_editing.collisions import DISTANCE

    others = _read_others(options.avoid)
    with locate_errors(f"{options.input} on {options.path}"):
        return _avoid_collisions(others, options.distance or DISTANCE, source, path=path, settings=settings,
                                 ground=ground, name=options.input.name)


def _edit_motion(source, path, settings, ground, options):
    """Move the motion onto the path; return the result and the same as a take."""
    import numpy as np

    from ..path_editing.path_edit import edit_path
    from ..path_editing.path_metrics import carry_contacts
    from ..path_editing.snap_turns import report_snap_turns

    with locate_errors(f"{options.input} on {options.path}"):
        edited = edit_path(source, path, settings, ground)
    edited = replace(edited, warnings=(*edited.warnings, *report_snap_turns(edited)))
    take = build_take(
        edited.motion, options.input.name, "ride", clip_frame=edited.frames,
        contacts=carry_contacts(edited).all(axis=2), seams=np.asarray(edited.transitions, int),
        warnings=tuple(edited.warnings), correction=edited.correction, ik_miss=edited.miss,
    )  # fmt: skip
    return edited, take


def _build_report(source, edited, take, path, ground) -> dict:
    """Build the report: the common figures, and how well the motion follows the path.

    Heights of feet are those over the ground below them, less their height in the recording, in both.
    """
    from ..evaluation.report import evaluate, list_message_spans, round_values
    from ..path_editing.path_metrics import measure_path_edit

    path_figures = round_values(measure_path_edit(source, edited, path, ground))
    if source.has_legs:
        report = evaluate(take, None, None)
    else:
        report = {"version": 1, "fps": take.motion.fps, "frames": len(take.motion), "duration_s": take.motion.duration}
    report["skate"] = {**report.get("skate", {}), **(path_figures["skate"] or {})}
    if feet := path_figures["ground_mm"]:
        names = {"min": "deepest", "support_max": "standing_max"}
        report["ground_mm"] = {of + name: feet[of + names[name]] for of in ("", "source_") for name in names}
        report["unknown"] = {name: why for name, why in report["unknown"].items() if not name.startswith("ground_mm.")}
    seams = {name: path_figures["seam_jerk"][name] for name in ("median", "max")}
    report["seam_jerk_ratio"] = {**report.get("seam_jerk_ratio", {}), **seams}
    return {**report, "root_error_m": path_figures["root_error_m"], "path": path_figures,
            "warnings": list(take.warnings), "warning_seconds": list_message_spans(list(take.warnings))}


def _read_others(paths: Sequence[Path]) -> list[Follower]:
    """Read the other recordings as fixed bodies; second 0 is their first frame."""
    import numpy as np

    from ..files.bvh import bvh
    from ..path_editing.detour import Follower

    motions = [(path.name, bvh.read_bvh(path).motion) for path in paths]
    return [
        Follower(name=name, times=np.arange(len(motion)) / motion.fps, places=motion.root_positions
                 - (0.0, 0.0, _HIP_HEIGHT)) for name, motion in motions
    ]


def _avoid_collisions(
    others: list[Follower], distance: float, source: PathEditSource, path, settings: PathEditSettings, ground, name: str
) -> tuple[PathEditSettings, tuple[str, ...]]:
    """Search for the delay and detours that keep a body `distance` metres from others.

    Args:
        others: the bodies that stay as they are.
        distance: metres between two bodies' centres at least.
        source: the recording, separated from its path.
        path: the new path.
        settings: the settings to start from.
        ground: the ground mesh, or None.
        name: name of the body, for the lines.
    Returns:
        The new settings, and one line for each change and for each collision that remains.
    """
    from ..path_editing.collision_avoidance import resolve_collisions
    from ..path_editing.path_edit import edit_path
    from ..path_editing.remedies import Limits

    # Search with unplanted feet, which is faster and moves the root the same way.
    edited, limits = edit_path(source, path, replace(settings, plant=False), ground), Limits(distance)
    follower = replace(_build_follower(name, edited), path=path, arc=edited.arc, by_arc=settings.by_arc_length)
    for _ in range(_MAX_ROUNDS):
        change = resolve_collisions([follower, *others], limits).changes[0]
        changed = _apply_change(settings, change, edited.motion.fps)
        edited_follower = _build_follower(name, edit_path(source, path, replace(changed, plant=False), ground))
        collisions = _find_collisions([edited_follower, *others], distance)
        if not collisions:
            break
        limits = replace(limits, distance=limits.distance + distance - min(hit.gap for hit in collisions) + 0.01)
    remaining = (f"still comes within {hit.gap:.2f} m of {others[hit.second - 1].name} at {hit.time:.1f} s"
                 for hit in collisions)
    lines = replace(change, delay=changed.delay - settings.delay).describe(follower.sampled_path.length)
    return changed, tuple(f"{name} {line}" for line in (*lines, *remaining))


def _build_follower(name: str, edited: EditedMotion) -> Follower:
    import numpy as np

    from ..path_editing.detour import Follower

    times = np.arange(len(edited.motion)) / edited.motion.fps
    return Follower(name=name, times=times,
                    places=np.column_stack([edited.motion.root_positions[:, :2], edited.origin[:, 2]]))


def _apply_change(settings: PathEditSettings, change: PathChange, fps: float) -> PathEditSettings:
    """Apply a change to the settings; bodies wait for whole frames."""
    import numpy as np

    delay = float(np.ceil(round(change.delay * fps, 3)) / fps)
    return replace(settings, delay=settings.delay + delay, detours=change.detours)


def _find_collisions(followers: list[Follower], distance: float) -> list:
    """Find the collisions of the first body with the others."""
    import numpy as np

    from ..path_editing.collisions import find_collisions

    times = np.unique(np.concatenate([follower.times for follower in followers]))
    places = np.stack([follower.at(times) for follower in followers])
    return [hit for hit in find_collisions(times, places, distance) if hit.first == 0]

