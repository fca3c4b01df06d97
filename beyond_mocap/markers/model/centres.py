"""Predict joint centres and segment axes from the landmarks of one frame.

Hips follow Harrington et al. 2007 ("Prediction of the hip joint centre in adults, children, and patients with cerebral
palsy based on magnetic resonance imaging", J Biomech 40:595): regressions on the width and depth of the pelvis. Knees,
ankles and elbows lie midway between their epicondyles and malleoli (Wu et al. 2002, 2005), or half a width away from
the lateral one, at right angles to the limb (Davis et al. 1991). Shoulders lie 15 % of the distance between the acromia
below them (17 % in Rab et al. 2002, measured from markers' centres to heads of the humerus that lie lower with hanging
arms). Pelvis, thorax and head take the rotation with which the typical body's landmarks (`template`) fit best.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from ...base.errors import InputError
from ...base.vectors import unit_vector
from ...motion import quaternion
from ..rigid_fit import compute_mean_rotation, fit_rigid
from .template import LANDMARK_PLACES, PLACES, TIPS

MARKER_RADIUS = 0.007  # metres
HALF_WIDTHS = {"knee": 0.052, "ankle": 0.036, "elbow": 0.036}
"""Half the width of a joint in metres, of an adult of 1.80 m; the marker's radius is added."""
SIGMAS = {"both": 0.006, "one side": 0.012, "hip": 0.007, "shoulder": 0.015, "alone": 0.02, "trunk": 0.02}
"""Uncertainty of a predicted centre in metres: the errors that the sources give, rounded."""
_normalize = partial(unit_vector, min_length=1e-12)  # metres; shorter vectors have no direction
_STRAIGHT = 0.14  # sine of the elbow angle (8 degrees) below which its plane is undetermined
_UPRIGHT = 0.35  # radians between trunk and vertical up to which the body counts as upright


@dataclass(kw_only=True)
class JointCentres:
    """The joint centres of one frame.

    Attributes:
        size: body size relative to the typical body.
        places: joint -> centre (3,) metres, world.
        axes: joint -> (3, 3), the columns are the joint's X, Y and Z axes in the world.
        sigma: joint -> uncertainty of the centre in metres.
        tips: joint -> place (3,) metres of its tip, world.
        notes: messages for people.
    """

    size: float
    places: dict[str, np.ndarray] = field(default_factory=dict)
    axes: dict[str, np.ndarray] = field(default_factory=dict)
    sigma: dict[str, float] = field(default_factory=dict)
    tips: dict[str, np.ndarray] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def add_joint(self, joint: str, place: np.ndarray, axes: np.ndarray, sigma: float) -> None:
        """Add a joint.

        Args:
            joint: its name.
            place: (3,) metres, world.
            axes: (3, 3) columns in the world.
            sigma: uncertainty in metres.
        """
        self.places[joint], self.axes[joint], self.sigma[joint] = place, axes, sigma


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
        _predict_leg(out, points, side, is_static)
        if "Chest" in out.axes and f"{side}_acromion" in points:
            _predict_arm(out, points, side)
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


def build_axes(axis: str, along: np.ndarray, second: str, towards: np.ndarray) -> np.ndarray:
    """Build right-handed axes from two directions.

    Args:
        axis: "X", "Y" or "Z", the axis that is exactly `along`.
        along: (3,) direction.
        second: the axis that lies nearest to `towards`.
        towards: (3,) direction.
    Returns:
        (3, 3), the columns are the X, Y and Z axes.
    """
    columns = {axis: _normalize(along)}
    columns[second] = _normalize(towards - (towards @ columns[axis]) * columns[axis])
    third = next(letter for letter in "XYZ" if letter not in columns)
    cyclic_order = {"X": ("Y", "Z"), "Y": ("Z", "X"), "Z": ("X", "Y")}[third]
    columns[third] = np.cross(columns[cyclic_order[0]], columns[cyclic_order[1]])
    return np.stack([columns[letter] for letter in "XYZ"], axis=-1)


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


def _predict_hinge(out, points, side, joint, above, hint) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Predict the centre of a knee, ankle or elbow.

    Args:
        out: the centres so far.
        points: landmark -> (3,) metres.
        side: "left" or "right".
        joint: "knee", "ankle" or "elbow".
        above: (3,) metres, the centre of the joint above.
        hint: (3,) rough outward direction, for joints with a marker on one side only.
    Returns:
        Centre, unit direction from the centre outwards, uncertainty in metres; None without markers.
    """
    lateral, medial = points.get(f"{side}_{joint}_lateral"), points.get(f"{side}_{joint}_medial")
    if lateral is None and medial is None:
        return None
    if lateral is not None and medial is not None:
        return 0.5 * (lateral + medial), _normalize(lateral - medial), SIGMAS["both"]
    marker, inwards = (lateral, -1.0) if medial is None else (medial, 1.0)
    half = out.size * HALF_WIDTHS[joint] + MARKER_RADIUS
    length = max(float(np.linalg.norm(above - marker)), 1e-6)
    up = (above - marker) / length
    outwards = _normalize(hint - (hint @ up) * up)
    sine = min(half / length, 0.9)  # so that the offset is at right angles to the line to the joint above
    return marker + half * (sine * up + inwards * np.sqrt(1.0 - sine**2) * outwards), outwards, SIGMAS["one side"]


def _predict_leg(out: JointCentres, points: Mapping[str, np.ndarray], side: str, is_static: bool) -> None:
    """Predict knee, ankle and foot of a leg."""
    name, sign = side.capitalize(), 1.0 if side == "left" else -1.0
    hip = out.places[f"{name}UpLeg"]
    knee = _predict_hinge(out, points, side, joint="knee", above=hip, hint=_estimate_knee_outwards(out, points, side,
            sign, is_static))
    if knee is None:
        raise InputError(f"{side} leg", "no marker on the knee", f"{side}_knee_lateral",
                         "add the leg markers to the marker set")
    ankle = _predict_hinge(out, points, side, joint="ankle", above=knee[0], hint=knee[1])
    if ankle is None:
        raise InputError(f"{side} leg", "no marker on the ankle", f"{side}_ankle_lateral",
                         "add the leg markers to the marker set")
    across = sign * knee[1]
    out.axes[f"{name}UpLeg"] = build_axes("Z", hip - knee[0], "Y", across)
    out.add_joint(f"{name}Leg", knee[0], build_axes("Z", knee[0] - ankle[0], "Y", across), knee[2])
    _predict_foot(out, points, side, ankle, is_static)


def _estimate_knee_outwards(out, points, side, sign, is_static) -> np.ndarray:
    """Estimate the outward direction of a knee with a lateral marker only.

    The marker on the thigh gives it, as in Plug-in Gait; in a static trial the pelvis counts more, since wands are
    seldom placed that precisely.
    """
    pelvis = sign * out.axes["Hips"][:, 1]
    wand, lateral = points.get(f"{side}_thigh"), points.get(f"{side}_knee_lateral")
    if wand is None or lateral is None:
        return pelvis
    up = _normalize(out.places[f"{side.capitalize()}UpLeg"] - lateral)
    away = (wand - lateral) - ((wand - lateral) @ up) * up
    return _normalize(away) + (2.0 * _normalize(pelvis - (pelvis @ up) * up) if is_static else 0.0)


def _predict_foot(out: JointCentres, points: Mapping[str, np.ndarray], side: str, ankle, is_static: bool) -> None:
    """Predict ankle and toe joint and the tip of the toes."""
    name = side.capitalize()
    marked = [x for x in ("heel", "toe", "metatarsal_1", "metatarsal_5", "toe_tip") if f"{side}_{x}" in points]
    front = [points[f"{side}_{x}"] for x in marked if x.startswith(("toe", "meta")) and x != "toe_tip"]
    front_names = [f"{side}_{x}" for x in marked if x.startswith(("toe", "meta")) and x != "toe_tip"]
    shank = out.axes[f"{name}Leg"]
    if not front:
        axes = shank
        out.notes.append(f"{side} foot: no marker at the toes; held at right angles to the shank")
    else:
        middle = np.mean(front, axis=0)
        behind = points.get(f"{side}_heel", ankle[0])
        axes = _build_foot_axes(out, points, side, ankle=ankle[0], forward=middle - behind, is_static=is_static)
    out.add_joint(f"{name}Foot", ankle[0], axes, ankle[2])
    away = PLACES[f"{name}ToeBase"] - PLACES[f"{name}Foot"]
    toe = ankle[0] + axes @ (out.size * away)
    if front:
        typical = np.mean([LANDMARK_PLACES[x][1] for x in front_names], axis=0)
        toe = np.mean(front, axis=0) + axes @ (out.size * (PLACES[f"{name}ToeBase"] - typical))
    out.add_joint(f"{name}ToeBase", toe, axes, SIGMAS["one side"])
    out.tips[f"{name}ToeBase"] = toe + axes @ (out.size * (TIPS[f"{name}ToeBase"] - PLACES[f"{name}ToeBase"]))


def _build_foot_axes(out, points, side, ankle, forward, is_static) -> np.ndarray:
    """Build the axes of a foot: level in a static trial, else as heel, toes and ankle lie on a typical foot."""
    name = side.capitalize()
    if is_static and abs(forward[2]) < 0.35 * np.linalg.norm(forward):
        return build_axes("Z", np.array([0.0, 0.0, 1.0]), "X", forward)
    names = [x for x, (carrier, _) in LANDMARK_PLACES.items() if carrier == f"{name}Foot" and x in points]
    typical = out.size * np.array([PLACES[f"{name}Foot"], *(LANDMARK_PLACES[x][1] for x in names)])
    fit = fit_rigid(typical, np.array([ankle, *(points[x] for x in names)]))
    return fit.rotation if fit.is_determined else build_axes("X", forward, "Z", out.axes[f"{name}Leg"][:, 2])


def _predict_arm(out: JointCentres, points: Mapping[str, np.ndarray], side: str) -> None:
    """Predict collar bone, shoulder blade, shoulder, elbow, wrist and hand."""
    name, sign = side.capitalize(), 1.0 if side == "left" else -1.0
    chest, acromion = out.axes["Chest"], points[f"{side}_acromion"]
    other = points.get("right_acromion" if side == "left" else "left_acromion")
    drop = 0.155 * np.linalg.norm(acromion - other) if other is not None else 0.06 * out.size
    shoulder = acromion - drop * chest[:, 2]
    out.axes[f"{name}Shoulder"] = chest
    out.add_joint(f"{name}Scapula", acromion - 0.25 * drop * chest[:, 2], chest, SIGMAS["one side"])
    wrist, radial = _predict_wrist(points, side)
    elbow = None
    marker = points.get(f"{side}_elbow_lateral", points.get(f"{side}_elbow_medial"))
    if marker is not None:
        outwards = _estimate_elbow_outwards(chest, shoulder, marker, sign)
        if wrist is None or radial is not None:
            elbow = _predict_elbow(out, points, side, sign=sign, shoulder=shoulder, wrist=wrist, radial=radial,
                                   default_outwards=outwards)
        else:
            elbow, wrist = _predict_elbow_and_wrist(out, points, side, sign=sign, shoulder=shoulder, marker=wrist,
                                                    default_outwards=outwards)
    if elbow is None:
        out.notes.append(f"{side} arm: no marker on the elbow; left out")
        return
    place, up, sigma = elbow
    out.add_joint(f"{name}Arm", shoulder, build_axes("Y", sign * (place - shoulder), "Z", up), SIGMAS["shoulder"])
    if wrist is None:
        out.notes.append(f"{side} forearm: no marker on the wrist; left out")
        return
    along = sign * (wrist - place)
    axes = build_axes("Y", along, "Z", up) if radial is None else build_axes("Y", along, "X", radial)
    out.add_joint(f"{name}ForeArm", place, axes, sigma)
    _predict_hand(out, points, side, sign=sign, wrist=wrist, forearm=axes,
                  sigma=SIGMAS["alone"] if radial is None else SIGMAS["both"])


def _predict_wrist(points, side) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Predict the wrist's centre and the direction from its ulnar to its radial side; None for what has no marker."""
    radial, ulnar = points.get(f"{side}_wrist_radial"), points.get(f"{side}_wrist_ulnar")
    if radial is not None and ulnar is not None:
        return 0.5 * (radial + ulnar), _normalize(radial - ulnar)
    single = [points[x] for x in (f"{side}_wrist", f"{side}_wrist_radial", f"{side}_wrist_ulnar") if x in points]
    return (single[0], None) if single else (None, None)


def _estimate_elbow_outwards(chest, shoulder, elbow, sign) -> np.ndarray:
    """Estimate the outward direction of an elbow, as if the arm came down from a T-pose on the shortest path."""
    turn = quaternion.rotation_between(sign * chest[:, 1], elbow - shoulder)
    return quaternion.rotate(turn, chest[:, 2])


def _predict_elbow_and_wrist(out, points, side, sign, shoulder, marker, default_outwards):
    """Predict elbow and wrist where a single `marker` lies on the back of the wrist.

    The back of the wrist depends on the elbow, and the elbow on the wrist's centre, so both are found by iteration.
    """
    inside = out.size * (LANDMARK_PLACES["left_wrist"][1] - PLACES["LeftHand"])[2]
    outwards = default_outwards
    for _ in range(4):
        wrist = marker - inside * outwards
        elbow = _predict_elbow(out, points, side, sign=sign, shoulder=shoulder, wrist=wrist, radial=None,
                               default_outwards=default_outwards)
        outwards = elbow[1]
    return elbow, wrist


def _predict_elbow(out, points, side, sign, shoulder, wrist, radial, default_outwards):
    """Predict an elbow's centre, the direction from its medial to its lateral side, and the uncertainty in metres."""
    lateral = points.get(f"{side}_elbow_lateral", points.get(f"{side}_elbow_medial"))
    if wrist is not None and f"{side}_elbow_medial" not in points:
        half = out.size * HALF_WIDTHS["elbow"] + MARKER_RADIUS
        outwards = _find_limb_plane(lateral, shoulder, wrist, half, -sign)
        if outwards is not None:
            return lateral - half * outwards, outwards, SIGMAS["one side"]
    hint = default_outwards if wrist is None or radial is None else sign * np.cross(radial, wrist - lateral)
    return _predict_hinge(out, points, side, joint="elbow", above=shoulder, hint=hint)


def _find_limb_plane(marker, above, below, half, sign) -> np.ndarray | None:
    """Find the limb plane through two joints that passes a marker at a given distance.

    Two planes do. In one of them the joint bends in the right sense: (upper x lower bone) x sign points to the marker.

    Args:
        marker: (3,) metres.
        above: (3,) metres, the joint above.
        below: (3,) metres, the joint below.
        half: distance in metres between marker and plane.
        sign: sense of the bend.
    Returns:
        (3,) the plane's normal towards the marker; None where the joint is too straight to have a plane.
    """
    line = _normalize(below - above)
    away = (marker - above) - ((marker - above) @ line) * line
    distance = float(np.linalg.norm(away))
    if distance < half * 1.001:
        return None
    away /= distance
    # the normals at distance `half` form an angle with `away` of which this is the cosine
    cosine = half / distance
    aside = np.sqrt(1.0 - cosine**2) * np.cross(line, away)
    for normal in (cosine * away + aside, cosine * away - aside):
        place = marker - half * normal
        fold = sign * np.cross(_normalize(place - above), _normalize(below - place))
        if fold @ normal > 0.0:
            return normal if np.linalg.norm(fold) > _STRAIGHT else None
    return None


def _predict_hand(out, points, side, sign, wrist, forearm, sigma) -> None:
    """Predict the hand and its tip."""
    name = side.capitalize()
    knuckle = points.get(f"{side}_knuckle")
    axes = forearm
    if knuckle is not None:  # the marker lies on the back of the hand, half its thickness above the bone
        axes = build_axes("Y", sign * (knuckle - 0.02 * out.size * forearm[:, 2] - wrist), "X", forearm[:, 0])
    out.add_joint(f"{name}Hand", wrist, axes, sigma)
    out.tips[f"{name}Hand"] = wrist + axes @ (out.size * (TIPS[f"{name}Hand"] - PLACES[f"{name}Hand"]))
