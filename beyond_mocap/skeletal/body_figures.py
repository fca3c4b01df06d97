"""How near a fitted body is to the joints that were seen, and how smoothly both move."""

from __future__ import annotations

import numpy as np

from ..library.repair import measure_slide
from ..motion.contacts import detect_heel_toe_contacts
from ..motion.humanoid import estimate_stature, identify_joints
from ..motion.motion import Motion, forward_kinematics

_ROLES = {"shoulder": "upper_arm", "elbow": "lower_arm", "wrist": "hand", "hip": "upper_leg", "knee": "lower_leg",
          "ankle": "foot"}


def list_fitted(landmarks: tuple[str, ...], motion: Motion) -> dict[int, int]:
    """List the landmarks that are joints of the body: index among `landmarks` -> joint of the skeleton."""
    body = identify_joints(motion.skeleton)
    out = {}
    for number, name in enumerate(landmarks):
        side, _, part = name.partition("_")
        if part in _ROLES and (joint := getattr(getattr(body, side), _ROLES[part])) is not None:
            out[number] = joint
    return out


def measure_body(landmarks: tuple[str, ...], seen: np.ndarray, motion: Motion) -> dict:
    """Measure a body against the joints that were seen.

    Args:
        landmarks: L names.
        seen: (T, L, 3) metres, NaN where not seen.
        motion: T frames.
    Returns:
        joint_error_m: mean, p95 and by landmark; seen: share of points; jerk_m_s3: p95 of the body's and of the raw
        joints; slide_m_s: of feet in contact; stature_m.
    """
    fitted = list_fitted(landmarks, motion)
    places, _ = forward_kinematics(motion)
    body, raw = places[:, list(fitted.values())], seen[:, list(fitted)]
    error = np.linalg.norm(body - raw, axis=2)
    known = np.isfinite(error)
    return {
        "frames": len(motion), "seconds": len(motion) / motion.fps, "seen": float(known.mean()),
        "joint_error_m": {
            "mean": float(error[known].mean()), "p95": float(np.percentile(error[known], 95)),
            "by_joint": {landmarks[number]: float(np.nanmean(error[:, column])) for column, number in enumerate(fitted)
                         if known[:, column].any()},
        },
        "jerk_m_s3": {"body": _measure_jerk(body, motion.fps), "joints": _measure_jerk(raw, motion.fps)},
        "slide_m_s": measure_slide(motion, detect_heel_toe_contacts(motion)),
        "stature_m": estimate_stature(motion.skeleton),
    }


def _measure_jerk(places: np.ndarray, fps: float) -> float | None:
    """Measure the 95th percentile of the third difference in m/s3; None where nothing is seen for four frames."""
    jerk = np.linalg.norm(np.diff(places, n=3, axis=0), axis=2) * fps**3
    jerk = jerk[np.isfinite(jerk)]
    return float(np.percentile(jerk, 95)) if len(jerk) else None
