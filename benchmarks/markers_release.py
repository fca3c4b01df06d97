"""When balls left hands: planted throws whose release is known, and pitches whose speed a radar took."""

from __future__ import annotations

import numpy as np

from benchmarks import markdown
from benchmarks.markers_real import made
from beyond_mocap.markers.files.marker_set_text import chosen_set
from beyond_mocap.markers.reconstruct import ReconstructSettings, reconstruct
from beyond_mocap.markers.release.release import ReleaseSettings, release
from beyond_mocap.synthetic.ground_truth.planted_ball import PlantedBall
from beyond_mocap.synthetic.ground_truth.planted_markers import Planted, planted
from beyond_mocap.synthetic.throws import throw

THROWS = (
    (18.0, 30.0, "right", "overarm", 240.0, 15.0), (18.0, 36.0, "right", "overarm", 360.0, 25.0),
    (12.0, 18.0, "left", "overarm", 200.0, 8.0), (10.0, 22.0, "right", "sidearm", 200.0, 0.0),
)
"""Metres to the target, m/s, arm, style, frames a second, revolutions a second."""
PITCHES = ("000870_003252_74_195_002_FF_808.c3d", "pitch_biodata.c3d")


def planted_table() -> list[str]:
    """Each planted throw with its ball's marker seen in flight, seen late, and with none."""
    lines = markdown.head([
        "throw", "ball's marker", "true m/s", "found m/s", "off", "time off ms, frames", "way off deg",
        "told sigma ms, m/s",
    ])  # fmt: skip
    for distance, speed, arm, style, fps, turns in THROWS:
        thrown = throw((distance, 0.0, 1.0), speed, arm, style, fps=fps)
        ball = PlantedBall(thrown.release, side=arm.title(), turns=turns)
        known = planted(thrown.motion, "driveline", seed=7, ball=ball)
        chosen = ReconstructSettings(marker_set=chosen_set("driveline"), release="no")
        motion = reconstruct(known.trial, known.static, settings=chosen).motion
        name = f"{speed:g} m/s {arm} {style}, {fps:g} Hz"
        for how, trial in _ways(known):
            lines.append(_row(name, how, known, trial, motion))
    return lines


def _ways(known: Planted):
    """The trial with all of the ball's marker, with it hidden for 40 ms around release, and without it."""
    label = known.ball.asked.label
    index = known.trial.index(label)
    frames = np.abs(np.arange(len(known.trial)) / known.trial.fps - known.ball.asked.release) < 0.04
    hidden = known.trial.positions.copy()
    hidden[frames, index] = np.nan
    yield "seen", known.trial
    yield "hidden 80 ms around", known.trial.with_positions(hidden)
    yield "none", known.trial.only([other for other in known.trial.labels if other != label])


def _row(name: str, how: str, known: Planted, trial, motion) -> str:
    truth, fps = known.ball, known.trial.fps
    try:
        found = release(trial, motion, ReleaseSettings(ball_marker="" if how == "none" else None))
    except Exception as problem:  # noqa: BLE001 a table tells what failed and goes on
        return markdown.row([name, how, f"{truth.speed:.1f}", f"failed: {problem}"[:120], *[""] * 4])
    late = found.time - truth.asked.release
    way = np.degrees(np.arccos(np.clip(found.direction @ truth.velocity / truth.speed, -1.0, 1.0)))
    return markdown.row([
        name, f"{how} ({found.how})", f"{truth.speed:.1f}", f"{found.speed:.1f}",
        f"{100 * (found.speed / truth.speed - 1):+.1f} %", f"{1e3 * late:+.1f}, {late * fps:+.1f}", f"{way:.1f}",
        f"{1e3 * found.time_sigma:.1f}, {found.speed_sigma:.1f}",
    ])  # fmt: skip


def radar_table() -> list[str]:
    """Pitches without a marker on the ball."""
    lines = markdown.head(["pitch", "found m/s", "radar m/s", "off", "told sigma m/s", "release s"])
    for trial in PITCHES:
        body = made(trial, None)
        found = release(body.raw, body.motion)
        radar = found.radar
        lines.append(markdown.row([
            trial, f"{found.speed:.1f}", "not told" if radar is None else f"{radar:.1f}",
            "" if radar is None else f"{100 * (found.speed / radar - 1):+.1f} %", f"{found.speed_sigma:.1f}",
            f"{found.time:.3f}",
        ]))  # fmt: skip
    return lines
