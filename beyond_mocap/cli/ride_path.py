"""The verb `path`: a recording follows another path and keeps its distance from bodies that already move.

To keep the distance it waits or takes a detour, as little as possible.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..base.errors import InputError
from ..base.settings.options import add_options, option_values
from .outputs import Told, Writer, build_take, check_outputs, naming, writer_of

if TYPE_CHECKING:
    from ..path_editing.detour import Change, Follower
    from ..path_editing.ride import Ridden, RideSettings, RideSource

_WHOLE = 0.95  # share of a path that counts as all of it
_ROUNDS = 3  # searches for delays and detours at most
_HIPS = 0.9  # metres, rough height of hips above the ground; only decides whether bodies are on one floor


def add_path(verbs):
    """Add the verb `path`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("path", help="move a recording onto another path")
    verb.add_argument("input", type=Path, metavar="IN.bvh")
    verb.add_argument("--path", type=Path, required=True, metavar="CURVE.csv", help="x_m,y_m[,z_m]: the new path")
    verb.add_argument("--out", type=Path, required=True, metavar="OUT.bvh")
    # Blender's Cycles add-on reads the arguments after `--` (batch.py) and quits over `--cycle`: hence the alias --loop
    add_options(verb, "path_editing")
    verb.set_defaults(run=run_path)
    return verb


def run_path(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """Run `path`: move the recording onto the path and write the requested files.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..files.bvh import bvh

    begun = time.perf_counter()
    inputs = (options.input, options.path, options.ground, *options.avoid)
    check_outputs(options.out, options.report, options.provenance, never=inputs)
    write = writer_of(options.out, writers)
    if options.control_degree and not options.control_points:
        raise InputError("--control-degree", "set without --control-points", "both", "add --control-points")
    if options.distance and not options.avoid:
        raise InputError("--distance", "set without --avoid", "both", "add --avoid OTHER.bvh")
    if options.closed and options.control_points:
        raise InputError("--closed", "set with --control-points", "one of them", "remove one: a B-spline is open")
    path, ground = _path(options), _ground(options)
    clip = bvh.read(options.input, options.unit)
    loaded = time.perf_counter()
    told.check()
    told.progress(0.2, "path")
    source, settings = _prepared(clip.motion, options)
    settings, asked = _apart(source, path, settings, ground, options)
    told.check()
    told.progress(0.5, "ride")
    ridden, take = _ridden(source, path, settings, ground, options)
    done = time.perf_counter()
    take.seconds.update(load=loaded - begun, construct=done - loaded, total=done - begun)
    told.check()
    report = _report(source, ridden, take, path, ground) if options.report else None
    told.check()
    notes = [f"{options.input}: {note}" for note in clip.notes]
    if options.out.suffix.lower() == ".bvh":
        notes += [f"{options.out}: {note}" for note in bvh.write(options.out, ridden.motion, clip.form)]
    else:
        write(take, options.out)
    _write_tables(options, take, report)
    told.end((*notes, *asked, *ridden.warnings, *_left_over(source, ridden, path, options)))
    gone = float(np.maximum(np.diff(ridden.arc), 0.0).sum())  # a repeated path starts again at 0
    print(f"{options.out}: {len(ridden.motion)} frames, {ridden.motion.duration:.1f} s, {gone:.1f} "
          f"m{_unit(clip, options)}")


def _left_over(source, ridden, path, options) -> list[str]:
    """Report where the motion ends long before the path."""
    from ..motion.path.arc_length import ArcLength

    gone, length = float(ridden.arc[-1]), ArcLength(path).length
    if options.cycle or options.end == "repeat" or source.still or gone >= _WHOLE * length:
        return []
    return [f"the motion ends after {gone:.1f} of {length:.1f} m of the path; --cycle repeats it"]


def _unit(clip, options) -> str:
    """Describe the output's unit where it differs from the input's."""
    same = options.out.suffix.lower() != ".bvh" or np.isclose(clip.form.unit, 0.01)
    return "" if same else "; positions in centimetres (--unit 0.01)"


def _write_tables(options, take, report: dict | None) -> None:
    from ..files.tables import write_report
    from ..synthesis.provenance import write_provenance

    if options.provenance:
        write_provenance(options.provenance, take)
    if report is not None:
        write_report(options.report, report)


def _path(options):
    """Read the new path."""
    from ..path_editing import path_line
    from ..path_editing.path_line import read_curve

    points = read_curve(options.path)
    with naming(options.path):
        if options.control_points:
            return path_line.b_spline(points, options.control_degree or 3)
        return path_line.through(points, str(options.path), closed=options.closed)


def _ground(options):
    """Read the ground mesh; None for the path's own height."""
    if options.ground is None:
        return None
    from ..files.obj import read_mesh
    from ..motion.path.terrain import Terrain

    return Terrain(*read_mesh(options.ground))


def _prepared(motion, options):
    """Separate the recording from its own path; return it with the settings."""
    from ..path_editing.ride import RideSettings, prepare

    settings = RideSettings(
        fit="polynomial" if options.degree else "spline", **option_values(RideSettings, options, "path_editing")
    )
    with naming(options.input):
        return prepare(motion, settings), settings


def _apart(source, path, settings, ground, options):
    """Add delays and detours that avoid other bodies; return the settings and a line for each change."""
    if not options.avoid:
        return settings, ()
    from ..path_editing.collisions import DISTANCE

    others = _read_others(options.avoid)
    with naming(f"{options.input} on {options.path}"):
        return _keep_clear(others, options.distance or DISTANCE, source, path=path, settings=settings, ground=ground,
                           name=options.input.name)


def _ridden(source, path, settings, ground, options):
    """Move the motion onto the path; return the result and the same as a take."""
    from ..path_editing.path_ride import carried
    from ..path_editing.ride import ride

    with naming(f"{options.input} on {options.path}"):
        ridden = ride(source, path, settings, ground)
    take = build_take(
        ridden.motion, options.input.name, "ride", clip_frame=ridden.frames, contacts=carried(ridden).all(axis=2),
        seams=np.asarray(ridden.seams, int), warnings=tuple(ridden.warnings), correction=ridden.correction,
        ik_miss=ridden.miss,
    )  # fmt: skip
    return ridden, take


def _report(source, ridden, take, path, ground) -> dict:
    """Build the report: the common figures, and how well the motion follows the path."""
    from ..evaluation.report import evaluate, rounded
    from ..path_editing.path_ride import figures

    ridden_well = rounded(figures(source, ridden, path, ground))
    if source.humanoid:
        report = evaluate(take, None, None)
    else:
        report = {"version": 1, "fps": take.motion.fps, "frames": len(take.motion), "duration_s": take.motion.duration}
    report["skate"] = {**report.get("skate", {}), **(ridden_well["skate"] or {})}
    seams = {name: ridden_well["seam_jerk"][name] for name in ("median", "max")}
    report["seam_jerk_ratio"] = {**report.get("seam_jerk_ratio", {}), **seams}
    return {**report, "root_error_m": ridden_well["root_error_m"], "path": ridden_well, "warnings": list(take.warnings)}


def _read_others(paths: Sequence[Path]) -> list[Follower]:
    """Read the other recordings as fixed bodies; second 0 is their first frame."""
    from ..files.bvh import bvh
    from ..path_editing.detour import Follower

    motions = [(path.name, bvh.read(path).motion) for path in paths]
    return [
        Follower(name=name, times=np.arange(len(motion)) / motion.fps, places=motion.root_positions - (0.0, 0.0, _HIPS))
        for name, motion in motions
    ]


def _keep_clear(
    others: list[Follower], distance: float, source: RideSource, path, settings: RideSettings, ground, name: str
) -> tuple[RideSettings, tuple[str, ...]]:
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
    from ..path_editing.apart import Limits, resolved
    from ..path_editing.ride import ride

    # Search with unplanted feet, which is faster and moves the root the same way.
    bare, limits = ride(source, path, replace(settings, plant=False), ground), Limits(distance)
    me = replace(_build_follower(name, bare), path=path, arc=bare.arc, by_arc=settings.by_arc_length)
    for _ in range(_ROUNDS):
        change = resolved([me, *others], limits).changes[0]
        asked = _apply_change(settings, change, bare.motion.fps)
        rider = _build_follower(name, ride(source, path, replace(asked, plant=False), ground))
        left = _find_collisions([rider, *others], distance)
        if not left:
            break
        limits = replace(limits, distance=limits.distance + distance - min(hit.gap for hit in left) + 0.01)
    still = (f"still comes within {hit.gap:.2f} m of {others[hit.second - 1].name} at {hit.time:.1f} s" for hit in left)
    return asked, tuple(f"{name} {line}" for line in (*_describe_changes(asked, settings), *still))


def _build_follower(name: str, ridden: Ridden) -> Follower:
    from ..path_editing.detour import Follower

    times = np.arange(len(ridden.motion)) / ridden.motion.fps
    return Follower(name=name, times=times,
                    places=np.column_stack([ridden.motion.root_positions[:, :2], ridden.origin[:, 2]]))


def _apply_change(settings: RideSettings, change: Change, fps: float) -> RideSettings:
    """Apply a change to the settings; bodies wait for whole frames."""
    waits = float(np.ceil(round(change.delay * fps, 3)) / fps)
    return replace(settings, delay=settings.delay + waits, detours=change.detours)


def _find_collisions(followers: list[Follower], distance: float) -> list:
    """Find the collisions of the first body with the others."""
    from ..path_editing.collisions import collisions

    times = np.unique(np.concatenate([follower.times for follower in followers]))
    places = np.stack([follower.at(times) for follower in followers])
    return [hit for hit in collisions(times, places, distance) if hit.first == 0]


def _describe_changes(asked: RideSettings, settings: RideSettings) -> list[str]:
    waits = asked.delay - settings.delay
    turns = (f"goes {abs(offset):.2f} m to the {'left' if offset > 0 else 'right'} {arc:.1f} m along the path"
             for arc, _, offset in asked.detours)  # fmt: skip
    return [*([f"waits {waits:.2f} s"] if waits else []), *turns]
