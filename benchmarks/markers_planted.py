"""Reconstruction of motions with synthetic markers: joints, angles, and what was hidden and swapped."""

from __future__ import annotations

import time
from functools import lru_cache

import numpy as np

from benchmarks import effort
from benchmarks.places import CMU_UNIT, DATA
from beyond_mocap.files.bvh import bvh
from beyond_mocap.markers.cleaning.clean import clean_trial
from beyond_mocap.markers.files.marker_set_text import choose_set
from beyond_mocap.markers.reconstruct import Reconstruction, ReconstructSettings, reconstruct
from beyond_mocap.motion.motion import Motion
from beyond_mocap.synthetic.ground_truth.synthetic_markers import SyntheticTrial, build_trial, measure_trial_error
from beyond_mocap.synthetic.throws import build_throw

CLIPS = {"walk": ("cmu10/test_walking_1.bvh", 0, 360), "run": ("cmu10/test_running_1.bvh", 0, 360),
         "kick": ("cmu10/10_01.bvh", 200, 560), "basketball": ("cmu10/train_basketball_1.bvh", 200, 560),
         "pitch": ("cmu_pitch/124_01.bvh", 260, 600),
         "run, LAFAN1": ("lafan1/fallAndGetUp1_subject4_run_filtered.bvh", 0, 360),
         "kick, LMD": ("lmd/Player1/P1_S01_penalty_kick.bvh", 0, 360)}
"""Recording, first and last frame."""
SHIPPED = {"lower_body": "plug_in_gait_legs"}
"""Synthetic marker set -> the shipped one that describes it, where the names differ."""
TRIED = (("walk", "plug_in_gait"), ("walk", "driveline"), ("walk", "sprinter"), ("walk", "full"),
         ("walk", "lower_body"), ("run", "plug_in_gait"), ("run", "sprinter"), ("kick", "plug_in_gait"),
         ("basketball", "driveline"), ("pitch", "driveline"), ("pitch", "plug_in_gait"), ("throw", "driveline"),
         ("run, LAFAN1", "driveline"), ("kick, LMD", "plug_in_gait"))
ON_BONE = (("walk", "plug_in_gait"), ("walk", "driveline"), ("pitch", "driveline"))
SPOILED = (("walk", "plug_in_gait"), ("basketball", "driveline"), ("pitch", "driveline"), ("run", "sprinter"))
TIMED = (("throw", "full"), ("pitch", "driveline"), ("basketball", "plug_in_gait"), ("run", "sprinter"))
_OCCLUDED = 0.03  # share of the samples that are hidden


@lru_cache(maxsize=None)
def read_clip(name: str) -> Motion:
    """Read a recording, or generate the throw at 30 m/s."""
    if name == "throw":
        return build_throw(speed=30.0, fps=200.0).motion
    file, first, last = CLIPS[name]
    unit = CMU_UNIT if file.startswith("cmu") else None
    return bvh.read_bvh(DATA / "mocap" / file, unit=unit).motion.frames(first, last)


def build_settings(planted_set: str, **others) -> ReconstructSettings:
    """Build the reconstruction settings of a marker set, without release, which is measured separately."""
    return ReconstructSettings(marker_set=choose_set(SHIPPED.get(planted_set, planted_set)), release="no", **others)


def reconstruct_trial(known: SyntheticTrial, static: bool, settings: ReconstructSettings) -> Reconstruction:
    """Reconstruct a synthetic trial."""
    return reconstruct(known.trial, known.static if static else None, settings=settings)


def truth_table() -> list[str]:
    """Build one row per clip, marker set, and static trial or none."""
    lines = [
        "Skin that shifts (thighs 10 to 16 mm), 0.5 mm of camera noise, 3 % of the samples hidden; the whole recipe "
        "with its filters. Angles: the whole angle between found and true joint rotation, all axes at once, root mean "
        "square over frames and joints, each segment's constant offset over the clip taken off (target 2); raw: with "
        "it. Centres: hips, knees, ankles, shoulders, elbows, wrists, in the world (target 10 mm).", "",
        *effort.format_head(["clip", "markers", "static", "angles deg", "raw deg", "centres mm", "p95 mm",
                             "residual mm", "one segment mm", "worst angle", "worst centre"]),
    ]  # fmt: skip
    for name, marker_set in TRIED:
        known = build_trial(read_clip(name), marker_set, seed=1, occlusion=_OCCLUDED)
        for static in (True, False):
            lines.append(_build_truth_row(name, marker_set, static, known))
    return lines


def bone_table() -> list[str]:
    """Build the same without skin and noise: the error of the reconstruction itself."""
    lines = effort.format_head(["clip", "markers", "angles deg", "raw deg", "centres mm", "residual mm"])
    for name, marker_set in ON_BONE:
        known = build_trial(read_clip(name), marker_set, seed=1, softness=0.0, noise=0.0)
        result = reconstruct_trial(known, True, build_settings(marker_set))
        error = measure_trial_error(known, result.motion)
        lines.append(effort.format_row([name, marker_set, f"{np.degrees(error.angle):.2f}",
                                        f"{np.degrees(error.raw_angle):.2f}", f"{1e3 * error.centre:.1f}",
                                        _format_rms_mm(result.solved.residual)]))
    return lines


def _build_truth_row(name: str, marker_set: str, static: bool, known: SyntheticTrial) -> str:
    """Build a row; a failure becomes its text."""
    begin = [name, marker_set, "yes" if static else "no"]
    try:
        result = reconstruct_trial(known, static, build_settings(marker_set))
        error = measure_trial_error(known, result.motion)
    except Exception as problem:  # noqa: BLE001 the table reports the failure and continues
        return effort.format_row([*begin, f"failed: {problem}"[:160], *[""] * 7])
    solved = result.solved
    return effort.format_row([*begin, f"{np.degrees(error.angle):.2f}", f"{np.degrees(error.raw_angle):.2f}",
                              f"{1e3 * error.centre:.1f}", f"{1e3 * error.worst_centre:.1f}",
                              _format_rms_mm(solved.residual), _format_rms_mm(solved.single),
                              _format_worst(error.angles, np.degrees(1.0), 1), _format_worst(error.centres, 1e3, 0)])


def _format_rms_mm(values: np.ndarray) -> str:
    """Format a root mean square in millimetres."""
    return f"{1e3 * np.sqrt(np.nanmean(values**2)):.1f}"


def _format_worst(of: dict[str, float], scale: float, digits: int) -> str:
    """Format the worst joint with its value."""
    joint = max(of, key=of.get)
    return f"{joint} {scale * of[joint]:.{digits}f}"


def filter_table() -> list[str]:
    """Build the rows of the same throw and walk with each filter."""
    lines = effort.format_head(
        ["clip", "filter", "angles deg", "centres mm", "fastest hand m/s", "true", "hand's acceleration off"]
    )
    for name, noise in (("walk", 5e-4), ("throw", 5e-4), ("throw", 2e-3)):
        marker_set = "driveline"
        known = build_trial(read_clip(name), marker_set, seed=2, noise=noise)
        for filter_name in ("none", "butterworth", "kalman"):
            result = reconstruct_trial(known, True, build_settings(marker_set, filter=filter_name, plant=False))
            error, (found, true, accelerated) = measure_trial_error(known, result.motion), _measure_hand(known,
                    result.motion)
            lines.append(effort.format_row([f"{name}, noise {1e3 * noise:g} mm", filter_name,
                                            f"{np.degrees(error.angle):.2f}", f"{1e3 * error.centre:.1f}",
                                            f"{found:.2f}", f"{true:.2f}", f"{accelerated:.1f} m/s^2"]))
    return lines


def _measure_hand(known: SyntheticTrial, found: Motion) -> tuple[float, float, float]:
    """Measure the fastest wrist found and true, m/s, and the error of its acceleration, root mean square m/s^2."""
    from beyond_mocap.motion.motion import forward_kinematics

    places, _ = forward_kinematics(found)
    wrist, truth = places[:, found.skeleton.index("RightHand")], known.centre("RightHand")
    moves = [np.gradient(trajectory, 1.0 / found.fps, axis=0) for trajectory in (wrist, truth)]
    pulls = [np.gradient(move, 1.0 / found.fps, axis=0) for move in moves]
    fastest = [float(np.linalg.norm(move, axis=1).max()) for move in moves]
    return *fastest, float(np.sqrt(np.mean(np.sum((pulls[0] - pulls[1]) ** 2, axis=1))))


def fault_table() -> list[str]:
    """Build the rows of planted faults: what was found and fixed."""
    lines = [
        "Hidden: share of the samples that are hidden; filled: of the hidden ones that have a place again, how far "
        "they are from where the marker was. Fixed: planted faults after which the samples are right; false: reports "
        "where nothing was planted; off afterwards: how far all samples are from the truth.", "",
        *effort.format_head(["clip", "markers", "hidden", "filled", "off mm rms, p95", "swaps fixed", "jumps fixed",
                             "unlabeled back", "false swaps, jumps", "off afterwards mm p99", "frames/s"]),
    ]  # fmt: skip
    for name, marker_set in SPOILED:
        for share in (0.05, 0.2):
            lines.append(_build_fault_row(name, marker_set, share))
    return lines


def _build_fault_row(name: str, marker_set: str, share: float) -> str:
    """Build a row of faults."""
    known = build_trial(read_clip(name), marker_set, seed=5, occlusion=share, swaps=4, jumps=8, unlabeled=3)
    own = choose_set(SHIPPED.get(marker_set, marker_set))
    started = time.process_time()
    cleaned = clean_trial(known.trial, own.select_clusters(known.trial.labels))
    took = time.process_time() - started
    trial = cleaned.trial
    names = known.trial.labels[: known.clean.shape[1]]
    after = trial.positions[:, [trial.labels.index(label) for label in names]]
    before = known.trial.positions[:, : len(names)]
    apart = np.linalg.norm(after - known.clean, axis=-1)
    hidden = ~np.isfinite(before[..., 0])
    filled = hidden & np.isfinite(apart)
    errors_mm = 1e3 * apart[filled]
    return effort.format_row([
        name, marker_set, f"{100 * hidden.mean():.0f} %", f"{100 * filled.sum() / max(hidden.sum(), 1):.0f} %",
        f"{np.sqrt(np.mean(errors_mm**2)):.1f}, {np.percentile(errors_mm, 95):.1f}" if len(errors_mm) else "",
        *(_count_fixed(known, names, apart, kind) for kind in ("swap", "jump", "unlabeled")),
        _count_false(known, cleaned.report), f"{1e3 * np.nanpercentile(apart, 99):.1f}",
        f"{len(trial) / max(took, 1e-9):.0f}",
    ])  # fmt: skip


def _count_fixed(known: SyntheticTrial, names: tuple[str, ...], apart: np.ndarray, kind: str) -> str:
    """Format how many faults are fixed, `3 of 4`: 9 in 10 samples are then within 15 mm of the truth."""
    faults = [fault for fault in known.faults if fault.kind == kind]
    right = 0
    for fault in faults:
        own = [names.index(label) for label in fault.labels if label in names]
        right += bool(np.mean(apart[fault.start : fault.stop, own] < 0.015) > 0.9)
    return f"{right} of {len(faults)}"


def _count_false(known: SyntheticTrial, report) -> str:
    """Format the number of swaps and jumps that are reported where none was planted."""
    counts = []
    for kind, reported in (("swap", report.swaps), ("jump", report.jumps)):
        planted_ones = [fault for fault in known.faults if fault.kind in (kind, "swap")]
        counts.append(sum(not any(_overlaps(stretch, known, fault) for fault in planted_ones) for stretch in reported))
    return ", ".join(str(count) for count in counts)


def _overlaps(stretch, known: SyntheticTrial, fault) -> bool:
    """Return whether a reported stretch overlaps a planted fault."""
    start, stop = stretch.start * known.trial.fps, stretch.end * known.trial.fps
    return start < fault.stop + 3 and stop > fault.start - 3 and bool(set(stretch.labels) & set(fault.labels))


def speed_table() -> list[str]:
    """Build the rows of the speed of the pose alone, on one core."""
    from beyond_mocap.markers.pose.pose import solve_poses

    lines = effort.format_head(["clip", "markers", "joints", "frames", "frames per second (target 200)", "weights off"])
    for name, marker_set in TIMED:
        known = build_trial(read_clip(name), marker_set, seed=3, occlusion=_OCCLUDED)
        result = reconstruct_trial(known, True, build_settings(marker_set))
        rates = [_measure_rate(result, solve_poses, weights) for weights in (True, False)]
        lines.append(effort.format_row([name, f"{marker_set}, {len(result.model.markers)}",
                                        str(len(result.model.skeleton)), str(len(result.trial)),
                                        *(f"{rate:.0f}" for rate in rates)]))
    return lines


def _measure_rate(result: Reconstruction, solve, weights: bool) -> float:
    """Measure frames per second of processor time, the best of two."""
    from beyond_mocap.markers.pose.pose import PoseSettings

    best = np.inf
    for _ in range(2):
        started = time.process_time()
        solve(result.model, result.trial, PoseSettings(weights=weights))
        best = min(best, time.process_time() - started)
    return len(result.trial) / best


