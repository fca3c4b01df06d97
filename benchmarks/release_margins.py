"""How often the margins of a release hold: synthetic throws over bent fingers and out of a rigid grip.

    python -m benchmarks.release_margins [THROWS]
"""

from __future__ import annotations

import sys
from collections.abc import Iterable

import numpy as np

from benchmarks import effort
from benchmarks.places import DATA
from beyond_mocap.base.errors import InputError
from beyond_mocap.files.bvh import bvh
from beyond_mocap.markers.pose.low_pass import filter_butterworth
from beyond_mocap.markers.release.release import Release, ReleaseSettings, estimate_release
from beyond_mocap.markers.release.throw_check import check_throw
from beyond_mocap.markers.release.throwing_hand import compute_steady_speeds
from beyond_mocap.motion.hand import build_hand
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion, forward_kinematics
from beyond_mocap.synthetic.ground_truth.finger_throws import build_finger_throw
from beyond_mocap.synthetic.ground_truth.synthetic_markers import SyntheticTrial

THROWS = 60
"""Throws of each kind."""
FIRST_SEED = 1000
"""Their first seed: the margins were chosen by throws of lower ones."""
_CUTOFF = 10.0  # Hz, of the filter through which motions come
_HEAD = ("ball leaves", "estimated from", "throws", "speed off %: median, p90", "direction off deg: median, p90",
         "time off ms: median, p90", "within the margin: speed", "direction", "time")


def margin_table(throws: int = THROWS) -> list[str]:
    """Build a row for bent fingers and for a rigid grip, without and with the ball's marker."""
    seeds = range(FIRST_SEED, FIRST_SEED + throws)
    lines = ["p90: of the absolute error. Margins are meant to hold in 90 % of the cases.", "",
             *effort.format_head(_HEAD)]
    for is_rigid, marker in ((False, ""), (True, ""), (False, None)):
        errors = [measure_error(known, found) for known, found in iter_releases(seeds, is_rigid, marker)]
        lines.append(_build_row("rigid grip" if is_rigid else "bent fingers", "hand" if marker == "" else "ball",
                                np.array(errors)))
    return lines


def refusal_table() -> list[str]:
    """Build a row for each folder of recordings: how many hands are refused as throwing none."""
    lines = ["Only `cmu_pitch` shows throws.", "", *effort.format_head(["recordings", "files", "refused"])]
    for folder in sorted(path for path in (DATA / "mocap").iterdir() if path.is_dir()):
        files = sorted(folder.rglob("*.bvh"))
        refused = sum(is_refused(bvh.read_bvh(file).motion) for file in files)
        lines.append(effort.format_row([folder.name, str(len(files)), str(refused)]))
    return lines


def is_refused(motion: Motion) -> bool:
    """Return whether the faster hand of a motion is refused as throwing nothing."""
    hands = [build_hand(motion, side) for side in ("left", "right")]
    hand, other = sorted(hands, key=lambda one: -compute_steady_speeds(one.origin, one.fps).max())
    hips = forward_kinematics(motion)[0][:, identify_joints(motion.skeleton).hips]
    try:
        check_throw(hand, [other], hips, "recording")
    except InputError:
        return True
    return False


def iter_releases(seeds: Iterable[int], is_rigid: bool, marker: str | None):
    """Generate the ground truth and the estimate of each throw; a throw that is refused is an error."""
    for seed in seeds:
        known = build_finger_throw(seed, is_rigid)
        motion = filter_butterworth(known.motion, _CUTOFF).motion
        try:
            yield known, estimate_release(known.trial, motion, ReleaseSettings(ball_marker=marker))
        except InputError as error:
            raise AssertionError(f"throw {seed} is refused: {error}") from error


def measure_error(known: SyntheticTrial, found: Release) -> tuple[float, ...]:
    """Measure errors of speed (share), direction (rad) and time (s), then the margins of each."""
    truth = known.ball
    angle = np.arccos(np.clip(found.direction @ truth.velocity / truth.speed, -1.0, 1.0))
    return (found.speed / truth.speed - 1.0, float(angle), found.time - truth.request.release,
            found.speed_margin / truth.speed, found.direction_margin, found.time_margin)


def _build_row(leaves: str, how: str, errors: np.ndarray) -> str:
    """Build a row from errors and margins (N, 6)."""
    scale = np.array([100.0, np.degrees(1.0), 1000.0])
    found, margins = errors[:, :3] * scale, errors[:, 3:] * scale
    pairs = [f"{np.median(column):+.1f}, {np.percentile(np.abs(column), 90):.1f}" for column in found.T]
    shares = np.mean(np.abs(found) <= margins, axis=0)
    return effort.format_row([leaves, how, str(len(errors)), *pairs, *(f"{100 * share:.0f} %" for share in shares)])


if __name__ == "__main__":
    print("\n".join(margin_table(int(sys.argv[1]) if len(sys.argv) > 1 else THROWS)))
