"""Figures of a reconstructed motion: how near its markers are, how far its feet slide, and what was corrected."""

from __future__ import annotations

import numpy as np

from ..base.errors import InputError
from ..motion import contacts as foot_contacts
from ..motion.humanoid import identify
from ..motion.motion import Motion, forward_kinematics
from ..synthesis.quality.movement import contact_speeds, foot_joints, stance_travel, stances
from .pose.residuals import residuals


def figures(made) -> dict:
    """Collect the report of a reconstruction.

    Args:
        reconstruction: a `reconstruct.Reconstruction`.
    Returns:
        Values for JSON; lengths of markers in millimetres, other units as the keys say.
    """
    solved, motion = made.solved, made.motion
    posing = made.seconds.get("pose") or solved.seconds
    return {"trial": made.raw.name, "subject": made.model.subject, "marker_set": made.model.set_name,
            "markers": len(made.model.markers), "joints": len(made.model.skeleton), "fps": motion.fps,
            "frames": len(motion), "duration_s": motion.duration, "seconds": dict(made.seconds),
            "residual_mm": residual_figures(made), "weighted_se": weighted_squares(solved),
            "frames_per_second": len(motion) / posing if posing else None, "bones_change_m": bones_change(motion),
            "skate": skate(motion), "limits": limit_shares(solved, motion.skeleton.names), "floor_m": made.floor,
            "grounded": made.grounded,
            "held_share": None if made.held is None else float(made.held.any(axis=(1, 2)).mean()),
            **made.cleaned.report.as_dict(), "release": None if made.release is None else made.release.report(),
            "warnings": list(made.warnings)}


def residual_figures(made) -> dict:
    """Measure the distances in millimetres between the model's markers and the recorded ones.

    Args:
        reconstruction: a `reconstruct.Reconstruction`.
    Returns:
        Figures of the solved pose, of every segment fitted alone (`single_mean`), and of the motion that is written,
        after its filters (`output_mean`).
    """
    seen = 1000.0 * made.solved.residual[np.isfinite(made.solved.residual)]
    single = 1000.0 * made.solved.single[np.isfinite(made.solved.single)]
    written = 1000.0 * residuals(made.model, made.motion, made.trial)
    each = {label: _mean(1000.0 * made.solved.residual[:, i]) for i, label in enumerate(made.model.markers)}
    return {"mean": _mean(seen), "rms": _rms(seen), "p95": _percentile(seen, 95), "max": _percentile(seen, 100),
            "single_mean": _mean(single), "single_rms": _rms(single), "output_mean": _mean(written),
            "output_rms": _rms(written), "per_marker": each}


def weighted_squares(solved) -> dict:
    """Measure the sum over markers of weight x residual^2 per frame, square metres: mean and standard deviation.

    Source: Fredriksson section 5.3.2, equation (5.1).
    """
    each = np.nansum(solved.weights * solved.residual**2, axis=1)
    return {"mean": float(each.mean()), "sd": float(each.std())} if len(each) else {"mean": None, "sd": None}


def bones_change(motion: Motion) -> float:
    """Measure the largest difference in metres between a bone's length in any frame and in the skeleton."""
    places, _ = forward_kinematics(motion)
    parents = np.array(motion.skeleton.parents[1:], dtype=int)
    lengths = np.linalg.norm(places[:, 1:] - places[:, parents], axis=-1)
    return float(np.abs(lengths - np.linalg.norm(motion.skeleton.offsets[1:], axis=-1)).max(initial=0.0))


def skate(motion: Motion) -> dict | None:
    """Measure how fast feet slide while in contact, and how far toes travel in a contact.

    Args:
        motion: the reconstructed motion.
    Returns:
        Values for JSON; None for a skeleton without legs or fewer than three frames.
    """
    try:
        identify(motion.skeleton)
    except InputError:
        return None
    if len(motion) < 3:
        return None
    standing = foot_contacts.detect(motion)
    places, _ = forward_kinematics(motion)
    feet = places[:, foot_joints(motion.skeleton)]
    travel = 1000.0 * stance_travel(feet[:, :, 1], stances(standing))
    return {"contact_cm_s": _mean(100.0 * contact_speeds(feet, standing, motion.fps)),
            "stance_mm_median": float(np.median(travel)) if len(travel) else None, "stances": len(travel)}


def limit_shares(solved, names) -> dict[str, float]:
    """Measure in which share of the frames each joint is at a limit; joints that never are, are left out."""
    share = np.asarray(solved.at_limit, dtype=bool).mean(axis=0)
    return {name: float(part) for name, part in zip(names, share) if part > 0}


def _mean(values: np.ndarray) -> float | None:
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else None


def _rms(values: np.ndarray) -> float | None:
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(values**2))) if len(values) else None


def _percentile(values: np.ndarray, share: float) -> float | None:
    return float(np.percentile(values, share)) if len(values) else None
