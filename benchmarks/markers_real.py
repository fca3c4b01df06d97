"""Real trials through the whole reconstruction; synthetic throws with a known release; pitches with a radar speed."""

from __future__ import annotations

import time
from functools import lru_cache
from pathlib import Path

import numpy as np

from benchmarks import effort
from benchmarks.places import DATA
from beyond_mocap.markers.files.marker_files import read_markers
from beyond_mocap.markers.files.marker_set_text import choose_set
from beyond_mocap.markers.reconstruct import Reconstruction, ReconstructSettings, reconstruct
from beyond_mocap.markers.release.release import ReleaseSettings, estimate_release
from beyond_mocap.motion import quaternion
from beyond_mocap.synthetic.ground_truth.synthetic_ball import BallRequest
from beyond_mocap.synthetic.ground_truth.synthetic_markers import SyntheticTrial, build_trial
from beyond_mocap.synthetic.throws import build_throw

TRIALS = (("000870_003252_74_195_002_FF_808.c3d", None), ("pitch_biodata.c3d", None),
          ("kinematics_tennis_serve.c3d", None), ("kinematics_tennis_serve_nan.c3d", None),
          ("sprinter_run0350cms.trc", "sprinter_static.trc"), ("sprinter_run0350cms.trc", None),
          ("sprinter_run0900cms.trc", "sprinter_static.trc"), ("PiG_Motion3_FF.c3d", "PiG_Calibration3_FF.c3d"),
          ("PiG_Motion3_FF.c3d", None), ("whole_body_stick_puck.c3d", None))
"""Trial and its static trial."""
FOLDER = DATA / "markers"

THROWS = ((18.0, 30.0, "right", "overarm", 240.0, 15.0), (18.0, 36.0, "right", "overarm", 360.0, 25.0),
          (12.0, 18.0, "left", "overarm", 200.0, 8.0), (10.0, 22.0, "right", "sidearm", 200.0, 0.0))
"""Metres to the target, m/s, arm, style, frames per second, revolutions per second."""
PITCHES = ("000870_003252_74_195_002_FF_808.c3d", "pitch_biodata.c3d")


@lru_cache(maxsize=None)
def reconstruct_timed(trial: str, static: str | None) -> tuple[Reconstruction, float]:
    """Reconstruct a trial, and measure its processor seconds."""
    still = None if static is None else read_markers(FOLDER / static)
    seen = read_markers(FOLDER / trial)
    started = time.process_time()
    return reconstruct(seen, still, settings=ReconstructSettings()), time.process_time() - started


def trial_table() -> list[str]:
    """Build one row per trial."""
    lines = [
        "Residual: model marker against measured one, of the pose; one segment: every cluster of at least three "
        "markers fitted alone, without joints and limits; written: of the motion after its filters.", "",
        *effort.format_head(["trial", "static", "set, markers, joints", "residual mm rms, p95", "one segment mm rms",
                             "written mm rms", "bones change", "planted feet cm/s, mm", "at a limit",
                             "fastest turn deg/frame", "seconds", "worst markers mm"]),
    ]  # fmt: skip
    return lines + [_build_row(trial, static) for trial, static in TRIALS]


def _build_row(trial: str, static: str | None) -> str:
    """Build the row of a trial; a failure becomes its text."""
    begin = [Path(trial).stem, "yes" if static else "no"]
    try:
        out, took = reconstruct_timed(trial, static)
        figures = out.report()
    except Exception as problem:  # noqa: BLE001 the table reports the failure and continues
        return effort.format_row([*begin, f"failed: {problem}"[:160], *[""] * 9])
    near, slide = figures["residual_mm"], figures["skate"]
    worst = sorted(((far, label) for label, far in near["per_marker"].items() if far), reverse=True)[:4]
    limits = sorted(((share, joint) for joint, share in figures["limits"].items() if share > 0.05), reverse=True)[:3]
    slides = slide is not None and slide["contact_cm_s"] is not None
    feet = f"{slide['contact_cm_s']:.1f}, {slide['stance_mm_median'] or 0:.0f}" if slides else ""
    return effort.format_row([*begin, f"{figures['marker_set']}, {figures['markers']}, {figures['joints']}",
                              f"{near['rms']:.1f}, {near['p95']:.1f}", f"{near['single_rms']:.1f}",
                              f"{near['output_rms']:.1f}", f"{figures['bones_change_m']:.0e} m", feet,
                              ", ".join(f"{joint} {100 * share:.0f} %" for share, joint in limits),
                              _format_fastest(out), f"{took:.1f}",
                              ", ".join(f"{label} {far:.0f}" for far, label in worst)])


def _format_fastest(out: Reconstruction) -> str:
    """Format the joint that turns most from one frame to the next: a flip would show here."""
    turns = out.solved.motion.rotations
    steps = np.linalg.norm(
        quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(turns[:-1]), turns[1:])), axis=-1
    )
    frame, joint = np.unravel_index(int(np.argmax(steps)), steps.shape)
    return f"{out.solved.motion.skeleton.names[joint]} {np.degrees(steps[frame, joint]):.0f} at {frame}"


def planted_table() -> list[str]:
    """Build the rows of each synthetic throw with its ball's marker seen in flight, seen late, and with none."""
    lines = effort.format_head(["throw", "ball's marker", "true m/s", "found m/s", "off", "time off ms, frames",
                                "direction error deg", "margin ms, m/s"])
    for distance, speed, arm, style, fps, turns in THROWS:
        thrown = build_throw((distance, 0.0, 1.0), speed, arm, style, fps=fps)
        ball = BallRequest(thrown.release, side=arm.title(), spin_rate=turns)
        known = build_trial(thrown.motion, "driveline", seed=7, ball=ball)
        settings = ReconstructSettings(marker_set=choose_set("driveline"), release="no")
        motion = reconstruct(known.trial, known.static, settings=settings).motion
        name = f"{speed:g} m/s {arm} {style}, {fps:g} Hz"
        for how, trial in _iter_trials(known):
            lines.append(_build_release_row(name, how, known, trial, motion))
    return lines


def _iter_trials(known: SyntheticTrial):
    """Generate the trial with all of the ball's marker, with it hidden 40 ms around release, and without it."""
    label = known.ball.request.label
    index = known.trial.index_of(label)
    frames = np.abs(np.arange(len(known.trial)) / known.trial.fps - known.ball.request.release) < 0.04
    hidden = known.trial.positions.copy()
    hidden[frames, index] = np.nan
    yield "seen", known.trial
    yield "hidden 80 ms around", known.trial.with_positions(hidden)
    yield "none", known.trial.select_markers([other for other in known.trial.labels if other != label])


def _build_release_row(name: str, how: str, known: SyntheticTrial, trial, motion) -> str:
    """Build the row of a release; a failure becomes its text."""
    truth, fps = known.ball, known.trial.fps
    try:
        found = estimate_release(trial, motion, ReleaseSettings(ball_marker="" if how == "none" else None))
    except Exception as problem:  # noqa: BLE001 the table reports the failure and continues
        return effort.format_row([name, how, f"{truth.speed:.1f}", f"failed: {problem}"[:120], *[""] * 4])
    time_error = found.time - truth.request.release
    direction_error = np.degrees(np.arccos(np.clip(found.direction @ truth.velocity / truth.speed, -1.0, 1.0)))
    return effort.format_row([name, f"{how} ({found.method})", f"{truth.speed:.1f}", f"{found.speed:.1f}",
                              f"{100 * (found.speed / truth.speed - 1):+.1f} %",
                              f"{1e3 * time_error:+.1f}, {time_error * fps:+.1f}", f"{direction_error:.1f}",
                              f"{1e3 * found.time_margin:.1f}, {found.speed_margin:.1f}"])


def radar_table() -> list[str]:
    """Build the rows of pitches without a marker on the ball."""
    lines = effort.format_head(["pitch", "found m/s", "radar m/s", "off", "margin m/s", "release s"])
    for trial in PITCHES:
        body, _ = reconstruct_timed(trial, None)
        found = estimate_release(body.raw, body.motion)
        radar = found.radar
        lines.append(effort.format_row([trial, f"{found.speed:.1f}", "unknown" if radar is None else f"{radar:.1f}",
                                        "" if radar is None else f"{100 * (found.speed / radar - 1):+.1f} %",
                                        f"{found.speed_margin:.1f}", f"{found.time:.3f}"]))
    return lines
