"""The verb `path`: a recording rides another path."""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ..base.errors import InputError
from ..base.settings.options import add_options, option_values
from .outputs import Writer, check_outputs, writer_of
from .progress_reporter import Told

_WHOLE = 0.95  # of a path, that is as good as all of it


def add(verbs):
    """The verb's parser."""
    verb = verbs.add_parser("path", help="a recording rides another path")
    verb.add_argument("input", type=Path, metavar="IN.bvh")
    verb.add_argument("--path", type=Path, required=True, metavar="CURVE.csv", help="x_m,y_m[,z_m]: the new path")
    verb.add_argument("--out", type=Path, required=True, metavar="OUT.bvh")
    # Blender's own Cycles add-on reads what stands behind `--` (batch.py) and ends Blender over `--cycle`: hence --loop
    add_options(verb, "path_editing")
    verb.set_defaults(run=run)
    return verb


def run(options, told: Told, writers: Mapping[str, Writer]) -> None:
    """`path`: rides it, and writes what was asked for about it."""
    from ..files.bvh import bvh

    begun = time.perf_counter()
    inputs = (options.input, options.path, options.ground, *options.avoid)
    check_outputs(options.out, options.report, options.provenance, never=inputs)
    write = writer_of(options.out, writers)
    if options.control_degree and not options.control_points:
        raise InputError("--control-degree", "without --control-points", "both", "add --control-points")
    if options.distance and not options.avoid:
        raise InputError("--distance", "without --avoid", "both", "add --avoid OTHER.bvh")
    if options.closed and options.control_points:
        raise InputError("--closed", "with --control-points", "one of them", "a B-spline has two ends")
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
    told.end()
    for note in (*notes, *asked, *ridden.warnings, *_left_over(source, ridden, path, options)):
        told.note(note)
    gone = float(np.maximum(np.diff(ridden.arc), 0.0).sum())  # where it begins anew it is set back
    print(f"{options.out}: {len(ridden.motion)} frames, {ridden.motion.duration:.1f} s, {gone:.1f} "
          f"m{_unit(clip, options)}")


def _left_over(source, ridden, path, options) -> list[str]:
    """A line where the motion ends long before the path."""
    from ..motion.path.arc_length import ArcLength

    gone, length = float(ridden.arc[-1]), ArcLength(path).length
    if options.cycle or options.end == "repeat" or source.still or gone >= _WHOLE * length:
        return []
    return [f"the motion ends after {gone:.1f} of {length:.1f} m; --cycle goes on"]


def _unit(clip, options) -> str:
    """What is said of the output's unit where it is not the input's."""
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
    """The new path."""
    from ..path_editing import path_line
    from ..path_editing.path_line import read_curve

    points = read_curve(options.path)
    try:
        if options.control_points:
            return path_line.b_spline(points, options.control_degree or 3)
        return path_line.through(points, str(options.path), closed=options.closed)
    except InputError as error:
        if error.where.startswith(str(options.path)):
            raise
        raise InputError(options.path, str(error)) from None  # points do not know their file


def _ground(options):
    """The mesh that the feet stand on, None for the path's own height."""
    if options.ground is None:
        return None
    from ..files.obj import read_mesh
    from ..motion.path.terrain import Terrain

    return Terrain(*read_mesh(options.ground))


def _prepared(motion, options):
    """The recording taken off its own path, and the settings."""
    from ..path_editing.ride import RideSettings, prepare

    settings = RideSettings(
        fit="polynomial" if options.degree else "spline", **option_values(RideSettings, options, "path_editing")
    )
    try:
        return prepare(motion, settings), settings
    except InputError as error:
        raise InputError(options.input, str(error)) from None  # a motion does not know its file


def _apart(source, path, settings, ground, options):
    """The settings that keep it clear of other bodies, and what these ask of it, one line each."""
    if not options.avoid:
        return settings, ()
    from ..path_editing.collisions import DISTANCE
    from .keep_apart import clear_of, read_others

    others = read_others(options.avoid)
    with _naming_files(options):
        return clear_of(others, options.distance or DISTANCE, source, path=path, settings=settings, ground=ground,
                        name=options.input.name)


@contextmanager
def _naming_files(options):
    """A ride does not know its files: errors are told with them."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{options.input} on {options.path}", str(error)) from None


def _ridden(source, path, settings, ground, options):
    """What was ridden, and the same as a take."""
    from ..annotation import Timeline
    from ..path_editing.path_ride import carried
    from ..path_editing.ride import ride
    from ..synthesis.take import Take

    with _naming_files(options):
        ridden = ride(source, path, settings, ground)
    count = len(ridden.motion)
    take = Take(
        motion=ridden.motion, start_time=0.0, clips=(options.input.name,), clip=np.zeros(count, int),
        clip_frame=ridden.frames, mirrored=np.zeros(count, bool), words=((),) * count,
        contacts=carried(ridden).all(axis=2), seams=np.asarray(ridden.seams, int), timeline=Timeline(), keys=(),
        ball=None, method="ride", seed=0, warnings=tuple(ridden.warnings), correction=ridden.correction,
        ik_miss=ridden.miss,
    )  # fmt: skip
    return ridden, take


def _report(source, ridden, take, path, ground) -> dict:
    """The contract's report, and beside it how well the path was ridden."""
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
