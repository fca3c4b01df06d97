"""Real trials through the whole recipe: how near the markers are, beside fitting every segment alone."""

from __future__ import annotations

import time
from functools import lru_cache
from pathlib import Path

import numpy as np

from benchmarks import markdown
from benchmarks.places import DATA
from beyond_mocap.markers.files.marker_files import read_markers
from beyond_mocap.markers.reconstruct import Reconstruction, ReconstructSettings, reconstruct
from beyond_mocap.motion import quaternion

TRIALS = (
    ("000870_003252_74_195_002_FF_808.c3d", None), ("pitch_biodata.c3d", None), ("kinematics_tennis_serve.c3d", None),
    ("kinematics_tennis_serve_nan.c3d", None), ("sprinter_run0350cms.trc", "sprinter_static.trc"),
    ("sprinter_run0350cms.trc", None), ("sprinter_run0900cms.trc", "sprinter_static.trc"),
    ("PiG_Motion3_FF.c3d", "PiG_Calibration3_FF.c3d"), ("PiG_Motion3_FF.c3d", None),
    ("whole_body_stick_puck.c3d", None),
)
"""Trial and static trial."""
FOLDER = DATA / "markers"


@lru_cache(maxsize=None)
def timed(trial: str, static: str | None) -> tuple[Reconstruction, float]:
    """A trial's reconstruction and the processor's seconds that it took."""
    still = None if static is None else read_markers(FOLDER / static)
    seen = read_markers(FOLDER / trial)
    begun = time.process_time()
    return reconstruct(seen, still, settings=ReconstructSettings()), time.process_time() - begun


def made(trial: str, static: str | None) -> Reconstruction:
    """A trial's reconstruction."""
    return timed(trial, static)[0]


def trial_table() -> list[str]:
    """One row per trial."""
    lines = [
        "Residual: model marker against seen one, of the pose; one segment: every cluster of at least three markers "
        "fitted alone, which knows no joints and no limits; written: of the motion after its filters.", "",
        *markdown.head([
            "trial", "static", "set, markers, joints", "residual mm rms, p95", "one segment mm rms", "written mm rms",
            "bones change", "standing feet cm/s, mm", "at a limit", "fastest turn deg/frame", "seconds",
            "worst markers mm",
        ]),
    ]  # fmt: skip
    return lines + [_row(trial, static) for trial, static in TRIALS]


def _row(trial: str, static: str | None) -> str:
    begin = [Path(trial).stem, "yes" if static else "no"]
    try:
        out, took = timed(trial, static)
        figures = out.report()
    except Exception as problem:  # noqa: BLE001 a table tells what failed and goes on
        return markdown.row([*begin, f"failed: {problem}"[:160], *[""] * 9])
    near, slide = figures["residual_mm"], figures["skate"]
    worst = sorted(((far, label) for label, far in near["per_marker"].items() if far), reverse=True)[:4]
    limits = sorted(((share, joint) for joint, share in figures["limits"].items() if share > 0.05), reverse=True)[:3]
    slides = slide is not None and slide["contact_cm_s"] is not None
    feet = f"{slide['contact_cm_s']:.1f}, {slide['stance_mm_median'] or 0:.0f}" if slides else ""
    return markdown.row([
        *begin, f"{figures['marker_set']}, {figures['markers']}, {figures['joints']}",
        f"{near['rms']:.1f}, {near['p95']:.1f}", f"{near['single_rms']:.1f}", f"{near['output_rms']:.1f}",
        f"{figures['bones_change_m']:.0e} m", feet,
        ", ".join(f"{joint} {100 * share:.0f} %" for share, joint in limits),
        _fastest(out), f"{took:.1f}",
        ", ".join(f"{label} {far:.0f}" for far, label in worst),
    ])  # fmt: skip


def _fastest(out: Reconstruction) -> str:
    """The joint that turns farthest from one frame of the pose to the next: a flip would stand out."""
    turns = out.solved.motion.rotations
    steps = np.linalg.norm(
        quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(turns[:-1]), turns[1:])), axis=-1
    )
    frame, joint = np.unravel_index(int(np.argmax(steps)), steps.shape)
    return f"{out.solved.motion.skeleton.names[joint]} {np.degrees(steps[frame, joint]):.0f} at {frame}"
