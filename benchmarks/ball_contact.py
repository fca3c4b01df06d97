"""Gap between striking part and ball on the written poses: passing scenes, and takes at solved touches."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from benchmarks import effort
from benchmarks.effort import format_head, format_row
from benchmarks.places import LIBRARIES, ROOT, library_folder, scenario
from beyond_mocap.ball.contact import striking_surface
from beyond_mocap.evaluation.report import cell, evaluate
from beyond_mocap.library.build import build
from beyond_mocap.library.library import Library
from beyond_mocap.motion.motion import pose_kinematics
from beyond_mocap.passes.passes import Passes, passes
from beyond_mocap.passes.scene_json import read_scene
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.synthesize import synthesize

SCENES = ("three", "six", "volley_net", "racquet", "dropped")
SAMPLES = ROOT / "sample_blend"


def gaps(made: Passes) -> tuple[np.ndarray, np.ndarray]:
    """Measure the strikes of a passing scene that touch the ball.

    Args:
        result: the scene's result.
    Returns:
        (K,) m between the surfaces of part and ball, by the pose played there and the ball as written; (K,) m from that
        ball to where the flight before was to arrive.
    """
    apart, off = [], []
    for strike in made.plan.strikes:
        order = strike.order
        if not order.touches:
            continue
        motion = next(player.take.motion for player in made.players if player.name == strike.player)
        frame = int(round(order.time * motion.fps))
        places, turned = pose_kinematics(motion.skeleton, motion.root_positions[frame], motion.rotations[frame])
        surface = striking_surface(motion.skeleton, order.part, order.side, order.tool)
        start, end = surface.line(places, turned)
        ball = made.ball.positions[frame]
        # nearest point of the part's line to the ball
        along = end - start
        share = np.clip((ball - start) @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
        away = float(np.linalg.norm(start + share * along - ball))
        apart.append(abs(away - surface.radius - made.kind.radius))
        off.append(float(np.linalg.norm(ball - np.array(order.ball))))
    return np.array(apart), np.array(off)


def scene_row(name: str, library: Library, label: str) -> str:
    """Build the row of a passing scene with one library."""
    scene = read_scene(SAMPLES / "passes" / f"{name}.json")
    took, made = effort.seconds(lambda: passes(library, scene), 1)
    apart, off = gaps(made)
    moved = np.concatenate([player.moved for player in made.players])
    return format_row([f"{name}, {label}", str(len(made.plan.strikes)), str(len(apart)),
                       f"{1000 * np.median(apart):.1f} / {1000 * apart.max():.1f}", f"{1000 * off.max():.1f}",
                       f"{100 * np.nanmax(moved, initial=0.0):.0f}", f"{made.plan.seconds:.1f}", f"{took:.1f}",
                       str(len(made.warnings))])


def take_rows(name: str, library: Library) -> list[str]:
    """Build the rows of the five scenarios at solved touches: every key moment with a ball."""
    rows = []
    for number in (1, 2, 3, 4, 5):
        track, timeline = scenario(number)
        plan = Plan(track=track, timeline=timeline, library=library.folder, nearest=True, method="path",
                    solve_touches=True)
        report = evaluate(synthesize(library, plan), track, library)
        for key in report["keys"]:
            gap, moved = key["met_gap_m"], key["solved_time_s"]
            if gap is not None and np.isfinite(gap):
                rows.append(format_row([f"{name}, scenario {number}", " ".join(key["labels"]), f"{key['time_s']:.2f}",
                                        "-" if moved is None else f"{moved:.2f}", f"{1000 * gap:.1f}",
                                        cell(key["ball_shift_m"]), cell(key["time_error_s"])]))
    return rows


def section() -> list[str]:
    """Build the lines for results.md."""
    lines = format_head(("passing scene, library", "strikes", "with contact", "gap mm (median / worst, target 5)",
                  "ball off its arrival mm", "part moved cm", "seconds of scene", "processor seconds",
                  "warnings"))  # fmt: skip
    with tempfile.TemporaryDirectory() as place:
        own = build(SAMPLES / "passes" / "library", cache_dir=Path(place))
        lines += [scene_row(name, own, "its own") for name in SCENES]
        lines += ["", *format_head(("take at solved touches", "labels", "requested s", "solved s", "gap mm (target 5)",
                             "ball moved m", "time error s"))]  # fmt: skip
        for name in LIBRARIES:
            folder = library_folder(name, Path(place))
            lines += take_rows(name, build(folder, unit=LIBRARIES[name], cache_dir=Path(place) / name))
    return lines
