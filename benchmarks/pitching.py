"""How the body throws: figures of synthetic and generated throws beside real pitches, by one formula for all.

Only places of joints are used, at 120 frames per second, so that skeletons of any kind compare. Heights and ways are
shares of the height of the head joint of the upright body. Turning is about the trunk's own axis, as in Fleisig et al.
1999.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks import effort
from benchmarks.markers_real import FOLDER, PITCHES, reconstruct_timed
from benchmarks.places import CMU_UNIT, DATA
from beyond_mocap.base.time_series import interpolate_columns, time_derivative
from beyond_mocap.base.vectors import unit_vectors
from beyond_mocap.files.bvh.bvh import read_bvh
from beyond_mocap.markers.release.release import estimate_release
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion, forward_kinematics, resample
from beyond_mocap.synthetic.performers import build_thrower, compute_effort, style_throw
from beyond_mocap.synthetic.throws import STYLES, build_throw
from beyond_mocap.throws.network_npz import read_shipped_model
from beyond_mocap.throws.throw import throw_at
from beyond_mocap.throws.throw_request import ThrowRequest

RATE = 120.0
TARGET = (18.0, 0.0, 1.0)  # m
SPEEDS = (18.0, 24.0, 31.0, 36.0)
"""m/s of the synthetic and generated throws."""
RECORDED = (("124_01", 447), ("124_03", 369))
"""Pitches of CMU and the frame of their release: the wrist is fastest 2 frames (0 to 4) before."""
COCKED = 0.15
"""s before the release in which the arm lies back."""
RECOVERED = (0.5, 0.9)
"""s after the release between which the body recovers."""
COLUMNS = ("throw", "stride", "leg lifted", "pelvis, trunk °/s", "elbow °/s", "elbow °", "lay-back °", "trunk tilt °",
           "hips lowered", "separation °", "recovery: tilt °, feet apart, hips lowered")


@dataclass(frozen=True, eq=False)
class BodyFigures:
    """What the body of a throw does; shares are of the height of the head joint.

    Attributes:
        stride: share, between the ankles as the ball leaves and where the back foot stood.
        lifted: share, greatest height of the leading ankle before the release above where it stands.
        pelvis, trunk: degrees/s, fastest turn of hips and shoulders toward the target.
        elbow_speed: degrees/s, fastest extension.
        elbow: degrees of bend as the ball leaves, 0 is straight.
        lay_back: degrees, how far the forearm lies back from the trunk's axis at most.
        tilt: degrees between the trunk and the vertical as the ball leaves.
        lowered: share, hips as the ball leaves below those of the upright body.
        separation: degrees, greatest turn of the shoulders behind the hips.
        recovery: degrees of tilt, and shares by which the feet are apart and the hips lowered, medians of RECOVERED.
    """

    stride: float
    lifted: float
    pelvis: float
    trunk: float
    elbow_speed: float
    elbow: float
    lay_back: float
    tilt: float
    lowered: float
    separation: float
    recovery: tuple[float, float, float]


def measure_body(motion: Motion, release: float, arm: str) -> BodyFigures:
    """Measure how the body throws.

    Args:
        motion: the throw, Z up.
        release: s at which the ball leaves.
        arm: "left" or "right".
    """
    at = _Landmarks(motion, arm)
    before = slice(max(0, int((release - 1.0) * RATE)), int((release + 0.05) * RATE))
    cocked = slice(int((release - COCKED) * RATE), int((release + 0.05) * RATE))
    trunk = unit_vectors(at.neck - at.hips, np.array([0.0, 0.0, 1.0]))
    sign = 1.0 if arm == "right" else -1.0
    tilt = np.degrees(np.arccos(np.clip(trunk[:, 2], -1.0, 1.0)))
    elbow = 180.0 - _measure_angles(at.shoulder - at.elbow, at.wrist - at.elbow)
    hip_turn, trunk_turn = (_measure_turn(line, trunk) for line in (at.hip_line, at.shoulder_line))
    lay_back = _measure_lay_back(trunk, at.elbow - at.shoulder, at.wrist - at.elbow) * sign
    behind = _measure_separation(at.hip_line, at.shoulder_line, trunk) * sign
    seconds = np.arange(len(tilt)) / RATE

    def read(values: np.ndarray) -> np.ndarray:
        return interpolate_columns(np.array([release]), seconds, values.reshape(len(values), -1))[0]

    stood = np.median(at.back_foot[before][: int(0.4 * RATE)], axis=0)
    lowered = (at.hip_height - at.hips[:, 2]) / at.head_height
    after = slice(int((release + RECOVERED[0]) * RATE), int((release + RECOVERED[1]) * RATE))
    apart = np.linalg.norm((at.front_foot - at.back_foot)[after, :2], axis=1) / at.head_height
    recovery = (tilt[after], apart, lowered[after])
    return BodyFigures(
        stride=float(np.linalg.norm((read(at.front_foot) - stood)[:2])) / at.head_height,
        lifted=float(at.front_foot[before, 2].max() - at.front_foot[:, 2].min()) / at.head_height,
        pelvis=float(hip_turn[before].max()), trunk=float(trunk_turn[before].max()),
        elbow_speed=float(-time_derivative(elbow, RATE)[before].min()), elbow=float(read(elbow)[0]),
        lay_back=float(lay_back[cocked].max()), tilt=float(read(tilt)[0]), lowered=float(read(lowered)[0]),
        separation=float(behind[before].max()),
        recovery=tuple(float(np.median(values)) if len(values) > 0.2 * RATE else np.nan for values in recovery),
    )


class _Landmarks:
    """Places (T, 3) m of joints at RATE, the throwing arm's first, and the size of the body."""

    def __init__(self, motion: Motion, arm: str):
        body = identify_joints(motion.skeleton)
        places = forward_kinematics(resample(motion, RATE))[0]
        throwing, other = (body.left, body.right) if arm == "left" else (body.right, body.left)
        self.hip_line = places[:, body.left.upper_leg] - places[:, body.right.upper_leg]
        self.shoulder_line = places[:, body.left.upper_arm] - places[:, body.right.upper_arm]
        self.hips = 0.5 * (places[:, body.left.upper_leg] + places[:, body.right.upper_leg])
        self.neck = 0.5 * (places[:, body.left.upper_arm] + places[:, body.right.upper_arm])
        self.shoulder, self.elbow = places[:, throwing.upper_arm], places[:, throwing.lower_arm]
        self.wrist, self.back_foot = places[:, throwing.hand], places[:, throwing.foot]
        self.front_foot = places[:, other.foot]
        chain = (other.upper_leg, other.lower_leg, other.foot)
        bones = places[0][list(chain[:-1])] - places[0][list(chain[1:])]
        ankle = float(self.front_foot[:, 2].min())
        self.hip_height = float(np.linalg.norm(bones, axis=-1).sum()) + ankle
        above = places[:, body.head_or_neck] - self.hips
        self.head_height = self.hip_height + float(np.percentile(np.linalg.norm(above, axis=-1), 90.0))


def _measure_angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Measure the angles (T,) degrees between vectors (T, 3)."""
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(-1)))


def _measure_turn(line: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Measure how fast (T,) degrees/s a line from right to left turns about an axis, either way."""
    across = unit_vectors(line - (line * axis).sum(-1, keepdims=True) * axis, np.array([0.0, 1.0, 0.0]))
    spin = np.cross(across, time_derivative(across, RATE))
    return np.degrees(np.abs((spin * axis).sum(-1)))


def _measure_lay_back(trunk: np.ndarray, upper: np.ndarray, lower: np.ndarray) -> np.ndarray:
    """Measure how far (T,) degrees the forearm of an arm that points out lies behind the trunk's axis."""
    along = unit_vectors(upper, np.array([1.0, 0.0, 0.0]))
    up, fore = (vector - (vector * along).sum(-1, keepdims=True) * along for vector in (trunk, lower))
    return np.degrees(np.arctan2((np.cross(up, fore) * along).sum(-1), (up * fore).sum(-1)))


def _measure_separation(hips: np.ndarray, shoulders: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Measure by how much (T,) degrees the shoulders are turned to the right of the hips, about the trunk."""
    a, b = (line - (line * axis).sum(-1, keepdims=True) * axis for line in (hips, shoulders))
    return -np.degrees(np.arctan2((np.cross(a, b) * axis).sum(-1), (a * b).sum(-1)))


def iter_real():
    """Generate (name, motion, release s, arm) of real pitches, where the recordings lie."""
    for trial in PITCHES if FOLDER.is_dir() else ():
        body, _ = reconstruct_timed(trial, None)
        found = estimate_release(body.raw, body.motion)
        yield f"real {trial[-7:-4]}, {found.speed:.0f} m/s", body.motion, found.time, found.side
    for name, frame in RECORDED if FOLDER.is_dir() else ():
        clip = read_bvh(DATA / "mocap" / "cmu_pitch" / f"{name}.bvh", CMU_UNIT)
        yield f"real CMU {name}", clip.motion, frame / clip.motion.fps, "right"


def iter_made():
    """Generate (name, motion, release s, arm) of synthetic throws, and of those that the shipped weights generate."""
    model, adult = read_shipped_model("throw"), build_thrower(0)
    for speed in SPEEDS:
        style = style_throw(STYLES["overarm"], adult.manner, compute_effort(adult, speed))
        made = build_throw(TARGET, speed, style=style)
        yield f"synthetic, {speed:g} m/s", made.motion, made.release, made.arm
    for speed in SPEEDS:
        thrown = throw_at(model, ThrowRequest(TARGET, speed=speed, fps=RATE))
        yield f"generated, {thrown.speed:.0f} m/s", thrown.motion, thrown.release, thrown.limb.split("_")[0]


def body_table() -> list[str]:
    """Build one row per throw."""
    lines = effort.format_head(COLUMNS)
    return lines + [_format_figures(name, measure_body(*throw)) for name, *throw in (*iter_made(), *iter_real())]


def _format_figures(name: str, of: BodyFigures) -> str:
    """Format the row of a throw."""
    tilt, apart, low = of.recovery
    recovery = "ends before" if np.isnan(tilt) else f"{tilt:.0f}, {apart:.2f}, {low:.2f}"
    return effort.format_row([name, f"{of.stride:.2f}", f"{of.lifted:.2f}", f"{of.pelvis:.0f}, {of.trunk:.0f}",
                              f"{of.elbow_speed:.0f}", f"{of.elbow:.0f}", f"{of.lay_back:.0f}", f"{of.tilt:.0f}",
                              f"{of.lowered:.2f}", f"{of.separation:.0f}", recovery])
