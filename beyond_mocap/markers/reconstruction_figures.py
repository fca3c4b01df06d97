"""Figures of a reconstructed motion: how near its markers are, how far its feet slide, and what was corrected."""

from __future__ import annotations

import numpy as np

from ..base.errors import InputError
from ..motion import contacts as foot_contacts
from ..motion.humanoid import identify_joints
from ..motion.motion import Motion, forward_kinematics
from ..synthesis.quality.movement import list_foot_joints, list_stances, measure_contact_speeds, measure_stance_travel
from .pose.residuals import measure_residuals

# Above these, standing toes are reported: cm/s, and mm in a stance, from which on people notice that feet slide.
_VISIBLE_TOE_SPEED, _VISIBLE_TRAVEL = 15.0, 25.0


def collect_figures(reconstruction) -> dict:
    """Collect the report of a reconstruction.

    Args:
        reconstruction: a `reconstruct.Reconstruction`.
    Returns:
        Values for JSON; lengths of markers in millimetres, other units as the keys say.
    """
    solved, motion = reconstruction.solved, reconstruction.motion
    posing = reconstruction.seconds.get("pose") or solved.seconds
    return {"trial": reconstruction.raw.name, "subject": reconstruction.model.subject,
            "marker_set": reconstruction.model.set_name, "markers": len(reconstruction.model.markers),
            "joints": len(reconstruction.model.skeleton), "fps": motion.fps, "frames": len(motion),
            "duration_s": motion.duration, "seconds": dict(reconstruction.seconds),
            "residual_mm": collect_residual_figures(reconstruction), "weighted_se": measure_weighted_squares(solved),
            "frames_per_second": len(motion) / posing if posing else None,
            "bones_change_m": measure_bone_change(motion), "skate": measure_foot_slide(motion),
            "limits": measure_limit_shares(solved, motion.skeleton.names), "floor_m": reconstruction.floor,
            "grounded": reconstruction.grounded, "held_share": None if reconstruction.held is None
            else float(reconstruction.held.any(axis=(1, 2)).mean()), **reconstruction.cleaned.report.as_dict(),
            "release": None if reconstruction.release is None else reconstruction.release.report(),
            "warnings": list(reconstruction.warnings)}


def collect_residual_figures(reconstruction) -> dict:
    """Measure the distances in millimetres between the model's markers and the recorded ones.

    Args:
        reconstruction: a `reconstruct.Reconstruction`.
    Returns:
        Figures of the solved pose, of every segment fitted alone (`single_mean`), and of the motion that is written,
        after its filters (`output_mean`).
    """
    seen = 1000.0 * reconstruction.solved.residual[np.isfinite(reconstruction.solved.residual)]
    single = 1000.0 * reconstruction.solved.single[np.isfinite(reconstruction.solved.single)]
    written = 1000.0 * measure_residuals(reconstruction.model, reconstruction.motion, reconstruction.trial)
    each = {label: _compute_mean(1000.0 * reconstruction.solved.residual[:, i]) for i,
            label in enumerate(reconstruction.model.markers)}
    return {"mean": _compute_mean(seen), "rms": _compute_rms(seen), "p95": _compute_percentile(seen, 95),
            "max": _compute_percentile(seen, 100), "single_mean": _compute_mean(single),
            "single_rms": _compute_rms(single), "output_mean": _compute_mean(written),
            "output_rms": _compute_rms(written), "per_marker": each}


def measure_weighted_squares(solved) -> dict:
    """Measure the sum over markers of weight x residual^2 per frame, square metres: mean and standard deviation.

    Source: Fredriksson section 5.3.2, equation (5.1).
    """
    each = np.nansum(solved.weights * solved.residual**2, axis=1)
    return {"mean": float(each.mean()), "sd": float(each.std())} if len(each) else {"mean": None, "sd": None}


def measure_bone_change(motion: Motion) -> float:
    """Measure the largest difference in metres between a bone's length in any frame and in the skeleton."""
    places, _ = forward_kinematics(motion)
    parents = np.array(motion.skeleton.parents[1:], dtype=int)
    lengths = np.linalg.norm(places[:, 1:] - places[:, parents], axis=-1)
    return float(np.abs(lengths - np.linalg.norm(motion.skeleton.offsets[1:], axis=-1)).max(initial=0.0))


def measure_foot_slide(motion: Motion) -> dict | None:
    """Measure how fast feet slide while in contact, and how far toes travel in a contact.

    Args:
        motion: the reconstructed motion.
    Returns:
        Values for JSON; None for a skeleton without legs or fewer than three frames.
    """
    try:
        identify_joints(motion.skeleton)
    except InputError:
        return None
    if len(motion) < 3:
        return None
    points = foot_contacts.detect_heel_toe_contacts(motion)
    contacts = points.all(axis=2)
    places, _ = forward_kinematics(motion)
    feet = places[:, list_foot_joints(motion.skeleton)]
    travel = 1000.0 * measure_stance_travel(feet[:, :, 1], list_stances(contacts))
    toes = measure_contact_speeds(feet[:, :, 1:], points[..., 1], motion.fps)
    return {"contact_cm_s": _compute_mean(100.0 * measure_contact_speeds(feet, contacts, motion.fps)),
            "toe_cm_s": _compute_mean(100.0 * toes),
            "stance_mm_median": float(np.median(travel)) if len(travel) else None, "stances": len(travel),
            "stances_over_25mm": int(np.count_nonzero(travel > _VISIBLE_TRAVEL))}


def describe_foot_slide(motion: Motion, is_planted: bool) -> list[str]:
    """Describe feet that slide so that one sees it; no line where they do not.

    Args:
        motion: the reconstructed motion.
        is_planted: whether the foot-plant filter was used.
    Returns:
        At most one message.
    """
    slide = measure_foot_slide(motion) or {}
    speed, travel = slide.get("toe_cm_s") or 0.0, slide.get("stance_mm_median") or 0.0
    if speed <= _VISIBLE_TOE_SPEED and travel <= _VISIBLE_TRAVEL:
        return []
    found = f"standing toes slide {travel:.0f} mm in the median stance, {speed:.0f} cm/s on average"
    if not is_planted:
        return [f"{found}: use Plant Feet"]
    held, far = f"the {_VISIBLE_TRAVEL:.0f} mm that foot planting holds", slide["stances_over_25mm"]
    if not far:
        return [f"{found}: no stance moves further than {held}; the contacts are short and fast, as in a sprint"]
    return [f"{found}: {far} of {slide['stances']} stances move further than {held}; check their markers"]


def measure_limit_shares(solved, names) -> dict[str, float]:
    """Measure in which share of the frames each joint is at a limit; joints that never are, are left out."""
    share = np.asarray(solved.at_limit, dtype=bool).mean(axis=0)
    return {name: float(part) for name, part in zip(names, share) if part > 0}


def _compute_mean(values: np.ndarray) -> float | None:
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else None


def _compute_rms(values: np.ndarray) -> float | None:
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(values**2))) if len(values) else None


def _compute_percentile(values: np.ndarray, share: float) -> float | None:
    return float(np.percentile(values, share)) if len(values) else None
