"""Predict the joint centres and axes of legs and arms from the landmarks of one frame.

Knees, ankles and elbows lie midway between their epicondyles and malleoli (Wu et al. 2002, 2005), or half a width away
from the lateral one, at right angles to the limb (Davis et al. 1991). Shoulders lie 15 % of the distance between the
acromia below them (17 % in Rab et al. 2002, measured from markers' centres to heads of the humerus that lie lower with
hanging arms).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...base.errors import InputError
from ...motion import quaternion
from ..rigid_fit import fit_rigid
from .joint_centres import MARKER_RADIUS, SIGMAS, JointCentres, build_axes, normalize
from .template import LANDMARK_PLACES, PLACES, TIPS

HALF_WIDTHS = {"knee": 0.052, "ankle": 0.036, "elbow": 0.036}
"""Half the width of a joint in metres, of an adult of 1.80 m; the marker's radius is added."""
_STRAIGHT = 0.14  # sine of the elbow angle (8 degrees) below which its plane is undetermined


def predict_leg(out: JointCentres, points: Mapping[str, np.ndarray], side: str, is_static: bool) -> None:
    """Predict knee, ankle and foot of a leg.

    Args:
        out: the centres so far, with the hips; the leg's are added.
        points: landmark -> (3,) metres, Z up.
        side: "left" or "right".
        is_static: whether this is a static trial, in which soles lie flat.
    Raises:
        InputError: if knee or ankle have no marker.
    """
    name, sign = side.capitalize(), 1.0 if side == "left" else -1.0
    hip = out.places[f"{name}UpLeg"]
    outwards = _estimate_knee_outwards(out, points, side, sign, is_static)
    knee = _predict_hinge(out, points, side, joint="knee", above=hip, hint=outwards)
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


def _estimate_knee_outwards(out, points, side, sign, is_static) -> np.ndarray:
    """Estimate the outward direction of a knee with a lateral marker only.

    The marker on the thigh gives it, as in Plug-in Gait; in a static trial the pelvis counts more, since wands are
    seldom placed that precisely.
    """
    pelvis = sign * out.axes["Hips"][:, 1]
    wand, lateral = points.get(f"{side}_thigh"), points.get(f"{side}_knee_lateral")
    if wand is None or lateral is None:
        return pelvis
    up = normalize(out.places[f"{side.capitalize()}UpLeg"] - lateral)
    away = (wand - lateral) - ((wand - lateral) @ up) * up
    return normalize(away) + (2.0 * normalize(pelvis - (pelvis @ up) * up) if is_static else 0.0)


def predict_arm(out: JointCentres, points: Mapping[str, np.ndarray], side: str) -> None:
    """Predict collar bone, shoulder blade, shoulder, elbow, wrist and hand; those without a marker are left out.

    Args:
        out: the centres so far, with the chest; the arm's are added.
        points: landmark -> (3,) metres, Z up, with the acromion.
        side: "left" or "right".
    """
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


def _predict_hand(out, points, side, sign, wrist, forearm, sigma) -> None:
    """Predict the hand and its tip."""
    name = side.capitalize()
    knuckle = points.get(f"{side}_knuckle")
    axes = forearm
    if knuckle is not None:  # the marker lies on the back of the hand, half its thickness above the bone
        axes = build_axes("Y", sign * (knuckle - 0.02 * out.size * forearm[:, 2] - wrist), "X", forearm[:, 0])
    out.add_joint(f"{name}Hand", wrist, axes, sigma)
    out.tips[f"{name}Hand"] = wrist + axes @ (out.size * (TIPS[f"{name}Hand"] - PLACES[f"{name}Hand"]))


def _predict_wrist(points, side) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Predict the wrist's centre and the direction from its ulnar to its radial side; None for what has no marker."""
    radial, ulnar = points.get(f"{side}_wrist_radial"), points.get(f"{side}_wrist_ulnar")
    if radial is not None and ulnar is not None:
        return 0.5 * (radial + ulnar), normalize(radial - ulnar)
    single = [points[x] for x in (f"{side}_wrist", f"{side}_wrist_radial", f"{side}_wrist_ulnar") if x in points]
    return (single[0], None) if single else (None, None)


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


def _estimate_elbow_outwards(chest, shoulder, elbow, sign) -> np.ndarray:
    """Estimate the outward direction of an elbow, as if the arm came down from a T-pose on the shortest path."""
    turn = quaternion.rotation_between(sign * chest[:, 1], elbow - shoulder)
    return quaternion.rotate(turn, chest[:, 2])


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
    line = normalize(below - above)
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
        fold = sign * np.cross(normalize(place - above), normalize(below - place))
        if fold @ normal > 0.0:
            return normal if np.linalg.norm(fold) > _STRAIGHT else None
    return None


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
        return 0.5 * (lateral + medial), normalize(lateral - medial), SIGMAS["both"]
    marker, inwards = (lateral, -1.0) if medial is None else (medial, 1.0)
    half = out.size * HALF_WIDTHS[joint] + MARKER_RADIUS
    length = max(float(np.linalg.norm(above - marker)), 1e-6)
    up = (above - marker) / length
    outwards = normalize(hint - (hint @ up) * up)
    sine = min(half / length, 0.9)  # so that the offset is at right angles to the line to the joint above
    return marker + half * (sine * up + inwards * np.sqrt(1.0 - sine**2) * outwards), outwards, SIGMAS["one side"]
