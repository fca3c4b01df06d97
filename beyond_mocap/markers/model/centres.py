"""Predict joint centres and segment axes from the landmarks of one frame.

Hips follow Harrington et al. 2007 ("Prediction of the hip joint centre in adults, children, and patients with cerebral
palsy based on magnetic resonance imaging", J Biomech 40:595): regressions on the width and depth of the pelvis. Pelvis,
thorax and head take the rotation with which the typical body's landmarks (`template`) fit best. Legs and arms hang on
them (`limb_centres`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...base.errors import InputError
from ..rigid_fit import compute_mean_rotation, fit_rigid
from .joint_centres import MARKER_RADIUS, SIGMAS, JointCentres, build_axes
from .limb_centres import predict_arm, predict_leg
from .template import LANDMARK_PLACES, PLACES, TIPS

_UPRIGHT = 0.35  # radians between trunk and vertical up to which the body counts as upright


def predict_centres(points: Mapping[str, np.ndarray], is_static: bool = True) -> JointCentres:
    """Predict centres and axes of all joints for which there are landmarks.

    Args:
        points: landmark -> (3,) metres, Z up.
        is_static: whether this is a static trial. The axes of an upright trunk are then vertical and soles lie flat;
            otherwise both follow the typical body.
    Returns:
        The predicted centres.
    Raises:
        InputError: if the landmarks of the pelvis or a leg are missing.
    """
    points = {name: np.asarray(place, dtype=float) for name, place in points.items() if np.isfinite(place).all()}
    out = JointCentres(size=estimate_body_size(points))
    _predict_pelvis(out, points)
    if any(LANDMARK_PLACES[name][0] == "Chest" for name in points):
        _predict_thorax(out, points)
        _predict_head(out, points)
    if is_static:
        _level_trunk_axes(out)
    _predict_spine(out)
    for side in ("left", "right"):
        predict_leg(out, points, side, is_static)
        if "Chest" in out.axes and f"{side}_acromion" in points:
            predict_arm(out, points, side)
    return out


def estimate_body_size(points: Mapping[str, np.ndarray]) -> float:
    """Estimate the body size relative to the typical body, as the median ratio of distances within segments and along
    limbs.

    Args:
        points: landmark -> (3,) metres.
    Returns:
        The ratio, between 0.4 and 1.6; 1 where nothing can be compared.
    """
    pairs = [
        (f"{side}_{a}", f"{side}_{b}")
        for side in ("left", "right")
        for a, b in (("knee_lateral", "ankle_lateral"), ("acromion", "elbow_lateral"), ("elbow_lateral", "wrist_ulnar"))
    ] + [("c7", "t10"), ("left_asis", "right_asis"), ("c7", "jugular_notch")]
    ratios = [
        np.linalg.norm(points[a] - points[b]) / np.linalg.norm(LANDMARK_PLACES[a][1] - LANDMARK_PLACES[b][1])
        for a, b in pairs if a in points and b in points
    ]
    return float(np.clip(np.median(ratios), 0.4, 1.6)) if ratios else 1.0


def _fit_segment(joint: str, points: Mapping[str, np.ndarray], size: float, beside: tuple[str, ...] = ()):
    """Fit the typical body's segment to its landmarks: rotation (3, 3) and shift (3,), or None if undetermined.

    `beside` are landmarks of other segments, used where there are too few of its own.
    """
    names = [name for name, (carrier, _) in LANDMARK_PLACES.items() if carrier == joint and name in points]
    rigid_names = [name for name in names if not name.endswith("scapula")]
    names = rigid_names if len(rigid_names) >= 3 else names
    if len(names) < 3:
        names += [name for name in beside if name in points]
    if len(names) < 3:
        return None
    typical = size * np.array([LANDMARK_PLACES[name][1] for name in names])
    fit = fit_rigid(typical, np.array([points[name] for name in names]))
    return (fit.rotation, fit.shift) if fit.is_determined else None


def _place_on_fit(fit, place: np.ndarray, size: float) -> np.ndarray:
    """Move a place of the typical body with a fit."""
    rotation, shift = fit
    return rotation @ (size * np.asarray(place)) + shift


def _predict_pelvis(out: JointCentres, points: Mapping[str, np.ndarray]) -> None:
    """Predict pelvis and hips; the root lies midway between the hips."""
    fit = _fit_segment("Hips", points, out.size)
    if fit is None:
        raise InputError("pelvis", "fewer than three landmarks", "both iliac spines and the sacrum",
                         "add the pelvis markers to the marker set")
    hips = _predict_hips(points)
    if hips is None:
        hips = {side: _place_on_fit(fit, PLACES[f"{side}UpLeg"], out.size) for side in ("Left", "Right")}
        out.notes.append("hips placed as on a typical pelvis: an iliac spine or the sacrum has no marker")
    out.add_joint("Hips", 0.5 * (hips["Left"] + hips["Right"]), fit[0], SIGMAS["hip"])
    for side, place in hips.items():
        out.places[f"{side}UpLeg"], out.sigma[f"{side}UpLeg"] = place, SIGMAS["hip"]


def _predict_hips(points: Mapping[str, np.ndarray]) -> dict[str, np.ndarray] | None:
    """Predict hip centres from both anterior spines and the posterior ones (or the sacrum); None if one is missing."""
    back = [points[name] for name in ("left_psis", "right_psis") if name in points]
    back = np.mean(back, axis=0) if len(back) == 2 else points.get("sacrum")
    if back is None or "left_asis" not in points or "right_asis" not in points:
        return None
    front = 0.5 * (points["left_asis"] + points["right_asis"])
    across = points["left_asis"] - points["right_asis"]
    axes = build_axes("Y", across, "X", front - back)
    # skin markers lie a radius away from the bone
    front, depth = front - MARKER_RADIUS * axes[:, 0], np.linalg.norm(front - back) - 2.0 * MARKER_RADIUS
    width = np.linalg.norm(across)
    # regression coefficients of Harrington et al. 2007, constants in metres
    ahead, up, side = -0.24 * depth - 0.0099, -0.30 * width - 0.0109, 0.33 * width + 0.0073
    return {name: front + axes @ np.array([ahead, sign * side, up]) for name, sign in (("Left", 1.0), ("Right", -1.0))}


def _predict_thorax(out: JointCentres, points: Mapping[str, np.ndarray]) -> None:
    """Predict chest, neck and collar bones."""
    fit = _fit_segment("Chest", points, out.size, ("left_acromion", "right_acromion"))
    if fit is None:
        raise InputError("thorax", "fewer than three landmarks, or all on one line",
                         "for instance c7, jugular_notch and t10", "add the thorax markers to the marker set")
    out.add_joint("Chest", _place_on_fit(fit, PLACES["Chest"], out.size), fit[0], SIGMAS["trunk"])
    neck = _place_on_fit(fit, PLACES["Neck"], out.size)
    if "c7" in points:  # anchored at the marker
        neck = points["c7"] + fit[0] @ (out.size * (PLACES["Neck"] - LANDMARK_PLACES["c7"][1]))
    out.add_joint("Neck", neck, fit[0], SIGMAS["trunk"])
    for side in ("Left", "Right"):
        place = _place_on_fit(fit, PLACES[f"{side}Shoulder"], out.size)
        if "jugular_notch" in points:
            away = PLACES[f"{side}Shoulder"] - LANDMARK_PLACES["jugular_notch"][1]
            place = points["jugular_notch"] + fit[0] @ (out.size * away)
        out.places[f"{side}Shoulder"], out.sigma[f"{side}Shoulder"] = place, SIGMAS["one side"]


def _predict_head(out: JointCentres, points: Mapping[str, np.ndarray]) -> None:
    """Predict the head."""
    fit = _fit_segment("Head", points, out.size)
    if fit is None:  # a head without markers is placed on the neck as on the typical body
        fit = (out.axes["Chest"], out.places["Neck"] - out.axes["Chest"] @ (out.size * PLACES["Neck"]))
        out.notes.append("head without markers: held straight on the neck")
    out.add_joint("Head", _place_on_fit(fit, PLACES["Head"], out.size), fit[0], SIGMAS["trunk"])
    out.tips["Head"] = _place_on_fit(fit, TIPS["Head"], out.size)


def _level_trunk_axes(out: JointCentres) -> None:
    """Make the trunk's axes level in a static trial, so that standing straight is the rest pose."""
    for joint in ("Hips", "Chest", "Head"):
        if joint in out.axes and out.axes[joint][2, 2] > np.cos(_UPRIGHT):
            out.axes[joint] = build_axes("Z", np.array([0.0, 0.0, 1.0]), "Y", out.axes[joint][:, 1])


def _predict_spine(out: JointCentres) -> None:
    """Predict the lumbar joints between pelvis and thorax, and the upper neck between neck and head."""
    if "Chest" not in out.axes:
        return
    pelvis, chest = out.axes["Hips"], out.axes["Chest"]
    out.add_joint("Spine", out.places["Hips"] + pelvis @ (out.size * PLACES["Spine"]), pelvis, SIGMAS["trunk"])
    low, high = PLACES["Spine"], PLACES["Chest"]
    middle = compute_mean_rotation(np.stack([pelvis, chest]))
    # `share`: height of Spine1 between Spine and Chest; `bow`: its offset from the straight line between them
    share = (PLACES["Spine1"][2] - low[2]) / (high[2] - low[2])
    bow = out.size * (PLACES["Spine1"] - (1.0 - share) * low - share * high)
    place = (1.0 - share) * out.places["Spine"] + share * out.places["Chest"] + middle @ bow
    out.add_joint("Spine1", place, middle, SIGMAS["trunk"])
    out.axes["Neck"] = chest
    middle = compute_mean_rotation(np.stack([chest, out.axes["Head"]]))
    out.add_joint("Neck1", 0.5 * (out.places["Neck"] + out.places["Head"]), middle, SIGMAS["trunk"])
