"""The verb `passes`: several players pass a ball to each other."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Mapping
from pathlib import Path

from .. import __version__
from ..base.errors import InputError, describe_no_folder, format_count
from ..base.settings.options import add_options, parse_path
from ..files.file_names import avoid_reserved_name
from .outputs import ProgressReporter, Writer, locate_errors


def add_passes(verbs):
    """Add the verb `passes`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("passes", help="several players pass a ball to each other")
    verb.add_argument("scene", type=parse_path, metavar="SCENE.json",
                      help="who passes to whom; see docs/reference/scene-json.md")
    verb.add_argument("--library", type=parse_path, required=True, help="a folder of clips with ball strikes")
    verb.add_argument("--out", type=parse_path, required=True, metavar="FOLDER", help="created if missing")
    add_options(verb, "library")
    verb.set_defaults(run=run_passes)
    return verb


def run_passes(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `passes`: simulate the scene and write its players, ball and reports.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..library.build import build_library
    from ..library.folder.recordings import find_recordings
    from ..passes.passes import build_ball, synthesize_passes
    from ..passes.scene_json import read_scene

    started = time.perf_counter()
    _check_folder(options.out, (options.library, *(path.parent for path in find_recordings(options.library))))
    scene = read_scene(options.scene)
    with locate_errors(options.scene):
        build_ball(scene)
    library = build_library(
        options.library, cache_dir=options.cache, skeleton=options.skeleton, unit=options.unit,
        progress=lambda share, text: reporter.show_progress(0.3 * share, text), cancelled=reporter.is_cancelled,
    )
    loaded = time.perf_counter()
    with locate_errors(options.scene):
        result = synthesize_passes(library, scene, lambda share, text: reporter.show_progress(0.3 + 0.65 * share, text),
                                   reporter.is_cancelled)
    done = time.perf_counter()
    reporter.check_cancelled()
    table = list_strikes(library, result)
    report = {**_build_report(result, table), "seconds": {"load": loaded - started, "play": done - loaded}}
    _write_results(options.out, result, table, report)
    reporter.finish(f"{options.scene}: {line}" for line in result.warnings)
    names = {avoid_reserved_name(player.name) for player in result.players}
    others = sorted(path.stem for path in options.out.glob("*.bvh") if path.stem not in names)
    if others:
        reporter.show_note(f"{options.out}: files of another scene: {', '.join(others)}")
    gaps = [row["contact_gap_m"] for row in table if row["outcome"] != "missed"]
    print(f"{options.out}: {len(result.players)} players, {format_count(len(table), 'strike')} in "
          f"{result.plan.seconds:.1f} s, widest gap {1000.0 * max(gaps, default=0.0):.1f} mm")  # fmt: skip


def _check_folder(folder: Path, taken: Iterable[Path]) -> None:
    """Check before the work that the folder exists or can be created, and is none of those that hold the library's
    recordings.
    """
    if folder.resolve() in {path.resolve() for path in taken}:
        raise InputError(folder, "holds recordings of the library", "another folder", "choose another folder")
    if folder.exists() and not folder.is_dir():
        raise InputError(folder, describe_no_folder(folder), "a folder", "choose another name")
    place = folder if folder.is_dir() else folder.absolute().parent
    if not place.is_dir():
        raise InputError(folder, "the folder above it does not exist", "an existing folder", "create that folder first")
    if not os.access(place, os.W_OK | os.X_OK):
        raise InputError(folder, "is not writable", "a writable folder", "choose another folder")


def list_strikes(library, played) -> list[dict]:
    """List the strikes of a scene as rows of strikes.csv.

    Args:
        library: the `Library` of the clips.
        played: the simulated scene.
    Returns:
        Column name -> value for each strike, in the plan's order.
    """
    import numpy as np

    out = []
    for number, strike in enumerate(played.plan.strikes):
        order, clip = strike.order, library.clips[strike.order.clip]
        x, y, z = order.ball
        out.append({
            "time_s": order.time, "frame": int(round(order.time * played.plan.fps)), "player": strike.player,
            "kind": order.kind,
            "part": order.part, "side": order.side, "clip": clip.path, "clip_frame": float(order.strike_frame),
            "mirrored": clip.mirrored, "x_m": x, "y_m": y, "z_m": z,
            "speed_in_m_s": float(np.linalg.norm(strike.velocity_in)),
            "speed_out_m_s": float(np.linalg.norm(strike.velocity_out)),
            "travel_s": strike.travel, "bounces": strike.bounces, "facing_deg": float(np.degrees(order.facing)),
            "contact_gap_m": played.find_gap(number), "outcome": strike.outcome,
        })  # fmt: skip
    return out


def _build_report(played, table: list[dict]) -> dict:
    """Build the report of a scene, for JSON."""
    plan, kind = played.plan, played.kind
    return {
        "version": __version__, "seed": played.scene.seed, "fps": plan.fps, "frames": len(played.ball.times),
        "duration_s": plan.seconds, "ball": vars(kind), "strikes": table,
        "bounces": [float(time) for flight in plan.flights for time in flight.bounces],
        "players": [_build_player_report(player) for player in played.players], "warnings": list(played.warnings),
    }


def _build_player_report(player) -> dict:
    """Build the evaluation of one player's motion, for JSON."""
    from ..evaluation.report import evaluate

    evaluation = evaluate(player.take, None, None)
    names = ("skate", "seam_jerk_ratio", "foot_correction_m", "ik_miss_share", "ground_mm")
    own = {"name": player.name, "strikes": len(player.gaps), "moved_m": player.part_shifts}
    return {**own, **{name: evaluation[name] for name in names}}


def _write_results(folder: Path, played, table: list[dict], report: dict) -> None:
    """Write all files of a scene to its folder."""
    from ..files.bvh import bvh
    from ..files.tables import write_ball, write_report
    from ..passes.scene_json import write_strikes
    from ..synthesis.provenance import write_provenance

    folder.mkdir(exist_ok=True)
    for player in played.players:
        name = avoid_reserved_name(player.name)
        bvh.write_bvh(folder / f"{name}.bvh", player.take.motion)
        write_provenance(folder / f"{name}.provenance.csv", player.take)
    write_ball(folder / "ball.csv", played.ball)
    write_strikes(folder / "strikes.csv", table)
    write_report(folder / "scene.report.json", report)
