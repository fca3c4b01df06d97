"""Gap between striking part and ball on the written poses: passing scenes, and takes at solved touches."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from benchmarks import effort
from benchmarks.effort import format_head, format_row
from benchmarks.places import LIBRARIES, ROOT, library_folder, read_scenario
from beyond_mocap.ball.contact import find_striking_surface
from beyond_mocap.evaluation.report import evaluate
from beyond_mocap.library.build import build_library
from beyond_mocap.library.library import Library
from beyond_mocap.motion.motion import compute_pose
from beyond_mocap.passes.passes import PlayedScene, synthesize_passes
from beyond_mocap.passes.scene_json import read_scene
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.synthesize import synthesize

SCENES = ("three", "six", "volley_net", "racquet", "dropped")
SAMPLES = ROOT / "sample_blend"


def measure_gaps(result: PlayedScene) -> tuple[np.ndarray, np.ndarray]:
    """Measure the strikes of a passing scene that touch the ball.

    Args:
        result: the scene's result.
    Returns:
        (K,) m between the surfaces of part and ball, by the pose played there and the ball as written; (K,) m from that
        ball to where the flight before was to arrive.
    """
    gaps_m, arrival_errors = [], []
    for strike in result.plan.strikes:
        order = strike.order
        if not order.touches:
            continue
        motion = next(player.take.motion for player in result.players if player.name == strike.player)
        frame = int(round(order.time * motion.fps))
        places, turned = compute_pose(motion.skeleton, motion.root_positions[frame], motion.rotations[frame])
        surface = find_striking_surface(motion.skeleton, order.part, order.side, order.tool)
        start, end = surface.compute_line(places, turned)
        ball = result.ball.positions[frame]
        # nearest point of the part's line to the ball
        along = end - start
        share = np.clip((ball - start) @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
        distance = float(np.linalg.norm(start + share * along - ball))
        gaps_m.append(abs(distance - surface.radius - result.kind.radius))
        arrival_errors.append(float(np.linalg.norm(ball - np.array(order.ball))))
    return np.array(gaps_m), np.array(arrival_errors)


def build_scene_row(name: str, library: Library, label: str) -> str:
    """Build the row of a passing scene with one library."""
    scene = read_scene(SAMPLES / "passes" / f"{name}.json")
    took, result = effort.measure_seconds(lambda: synthesize_passes(library, scene), 1)
    gaps_m, arrival_errors = measure_gaps(result)
    moved, strikes = np.concatenate([player.part_shifts for player in result.players]), result.plan.strikes
    distinct = {(one.order.clip, one.order.hit.first) for one in strikes[:8]}
    return format_row([f"{name}, {label}", str(len(strikes)), f"{len(distinct)} of {len(strikes[:8])}",
                       f"{np.mean([one.cost for one in strikes[:-1]]):.1f}", str(len(gaps_m)),
                       f"{1000 * np.median(gaps_m):.1f} / {1000 * gaps_m.max():.1f}",
                       f"{1000 * arrival_errors.max():.1f}", f"{100 * np.nanmax(moved, initial=0.0):.0f}",
                       f"{result.plan.seconds:.1f}", f"{took:.1f}", str(len(result.warnings))])


def build_take_rows(name: str, library: Library) -> list[str]:
    """Build the rows of the five scenarios at solved touches: every key moment with a ball."""
    rows = []
    for number in (1, 2, 3, 4, 5):
        track, timeline = read_scenario(number)
        plan = Plan(track=track, timeline=timeline, library=library.folder, nearest=True, method="path",
                    solve_touches=True)
        report = evaluate(synthesize(library, plan), track, library)
        for key in report["keys"]:
            gap, moved = key["met_gap_m"], key["solved_time_s"]
            if gap is not None and np.isfinite(gap):
                rows.append(format_row([f"{name}, scenario {number}", " ".join(key["labels"]), f"{key['time_s']:.2f}",
                                        "-" if moved is None else f"{moved:.2f}", f"{1000 * gap:.1f}",
                                        _format_cell(key["ball_shift_m"]), _format_cell(key["time_error_s"])]))
    return rows


def _format_cell(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def section() -> list[str]:
    """Build the lines for results.md."""
    lines = format_head(("passing scene, library", "strikes", "distinct of the first",
                         "mean cost m/s", "with contact", "gap mm (median / worst, target 5)",
                         "ball off its arrival mm", "part moved cm", "seconds of scene", "processor seconds",
                         "warnings"))  # fmt: skip
    with tempfile.TemporaryDirectory() as place:
        own = build_library(SAMPLES / "passes" / "library", cache_dir=Path(place))
        lines += [build_scene_row(name, own, "its own") for name in SCENES]
        lines += ["", *format_head(("take at solved touches", "labels", "requested s", "solved s", "gap mm (target 5)",
                                    "ball moved m", "time error s"))]  # fmt: skip
        for name in LIBRARIES:
            folder = library_folder(name, Path(place))
            lines += build_take_rows(name, build_library(folder, unit=LIBRARIES[name], cache_dir=Path(place) / name))
    return lines
