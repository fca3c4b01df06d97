"""Marker sets and models from one frame: the typical body's landmarks give the typical body back."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.markers.files.marker_set_text import read_shipped_sets
from beyond_mocap.markers.model.assemble import build_model_from_frame
from beyond_mocap.markers.model.marker_set import MarkerSet, choose_marker_set
from beyond_mocap.markers.model.template import LANDMARK_PLACES, PLACES
from beyond_mocap.motion.humanoid import identify_joints

SMALL = MarkerSet("small", {"Hips": ("LASI", "RASI", "SACR")})
LARGE = MarkerSet(
    "large", {"Hips": ("LASI", "RASI", "SACR"), "LeftArm": ("LELB", "LMELB")},
    aliases={"LASIS": "LASI"}, static=frozenset({"LMELB"}),
)


def everything():
    """A set in which every landmark is marked by a marker of its name."""
    segments = {}
    for name, (joint, _) in LANDMARK_PLACES.items():
        segments.setdefault(joint, []).append(name)
    return MarkerSet("everything", segments, {name: (name,) for name in LANDMARK_PLACES})


def typical(turn=0.0, size=1.0):
    """Every landmark's place on the typical body, turned about the vertical and scaled."""
    c, s = np.cos(turn), np.sin(turn)
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return {name: size * turned @ place for name, (_, place) in LANDMARK_PLACES.items()}


def test_the_typical_body_comes_back_whichever_way_it_faces():
    for turn, size in ((0.0, 1.0), (2.1, 1.0), (-1.0, 0.9)):
        model = build_model_from_frame(typical(turn, size), everything())
        skeleton = model.skeleton
        places = np.zeros((len(skeleton), 3))
        for index, parent in enumerate(skeleton.parents):
            if parent >= 0:
                places[index] = places[parent] + skeleton.offsets[index]
        wanted = np.array([size * (PLACES[name] - PLACES["Hips"]) for name in skeleton.names])
        assert np.abs(places - wanted).max() < 0.012
        limbs = [i for i, name in enumerate(skeleton.names) if name.endswith(("ForeArm", "Hand", "Leg", "Foot"))]
        assert np.abs(places[limbs] - wanted[limbs]).max() < 0.012


def test_arms_lie_along_y_and_legs_along_z_in_the_rest_pose():
    skeleton = build_model_from_frame(typical(0.7), everything()).skeleton
    for name, direction in (("LeftForeArm", (0, 1, 0)), ("RightHand", (0, -1, 0)), ("LeftLeg", (0, 0, -1)),
                            ("RightFoot", (0, 0, -1))):
        offset = skeleton.offsets[skeleton.index(name)]
        assert np.allclose(offset / np.linalg.norm(offset), direction, atol=1e-9)


def test_the_skeleton_is_read_as_a_body():
    body = identify_joints(build_model_from_frame(typical(), everything()).skeleton)
    assert body.left.upper_arm is not None and body.head is not None and body.right.toe is not None


def test_a_lone_lateral_marker_finds_the_knee_half_a_width_inside():
    frame = {name: place for name, place in typical(0.4).items() if not name.endswith("knee_medial")}
    skeleton = build_model_from_frame(frame, everything()).skeleton
    for side in ("Left", "Right"):
        length = np.linalg.norm(skeleton.offsets[skeleton.index(f"{side}Leg")])
        assert length == pytest.approx(0.43, abs=0.008)


def test_a_lone_medial_marker_does_as_well():
    frame = {name: place for name, place in typical(0.4).items()
             if not name.endswith(("knee_lateral", "ankle_lateral", "elbow_lateral"))}
    skeleton = build_model_from_frame(frame, everything()).skeleton
    for name, length in (("LeftLeg", 0.43), ("RightFoot", 0.435), ("LeftForeArm", 0.30)):
        assert np.linalg.norm(skeleton.offsets[skeleton.index(name)]) == pytest.approx(length, abs=0.012)


def test_shoulders_stand_in_for_a_thorax_that_is_hardly_marked():
    frame = {name: place for name, place in typical().items()
             if LANDMARK_PLACES[name][0] != "Chest" or name in ("jugular_notch", "t7")}
    skeleton = build_model_from_frame(frame, everything()).skeleton
    assert np.linalg.norm(skeleton.offsets[skeleton.index("LeftForeArm")]) == pytest.approx(0.30, abs=0.012)


def test_legs_alone_make_a_body_of_legs_alone():
    below = {name: place for name, place in typical().items()
             if any(part in LANDMARK_PLACES[name][0] for part in ("Hips", "Leg", "Foot", "Toe"))}
    model = build_model_from_frame(below, everything())
    assert "Chest" not in model.skeleton.names and "RightToeBase" in model.skeleton.names


def test_joints_without_markers_are_held():
    frame = {name: place for name, place in typical().items() if LANDMARK_PLACES[name][0] != "Head"}
    model = build_model_from_frame(frame, everything())
    head = model.skeleton.index("Head")
    assert not model.freedom.free[head].any() and model.freedom.free[model.skeleton.index("LeftArm")].all()


def test_a_pelvis_that_nothing_marks_is_refused_in_one_line():
    frame = {name: place for name, place in typical().items() if LANDMARK_PLACES[name][0] != "Hips"}
    with pytest.raises(InputError, match="pelvis"):
        build_model_from_frame(frame, everything())


def test_the_set_that_explains_most_is_recognised():
    assert choose_marker_set(["LASI", "RASI", "SACR", "LELB", "*3"], [SMALL, LARGE]) is LARGE
    assert choose_marker_set(["LASI", "RASI", "SACR"], [SMALL, LARGE]) is SMALL


def test_the_nearest_set_is_named_with_what_is_missing():
    with pytest.raises(InputError, match="nearest is small.*SACR"):
        choose_marker_set(["LASI", "RASI", "KNEE"], [SMALL, LARGE])


def test_labels_are_matched_whatever_their_case_and_by_aliases():
    assert LARGE.map_labels(["LASIS", "rasi", "S-ACR"]) == {"LASIS": "LASI", "rasi": "RASI", "S-ACR": "SACR"}


@pytest.mark.parametrize("segments, landmarks, what", [
    ({"Hip": ("A",)}, {}, "segment 'Hip'"),
    ({"Hips": ("A",), "Head": ("A",)}, {}, "'A' on two segments"),
    ({"Hips": ("A",)}, {"left_nose": ("A",)}, "landmark 'left_nose'"),
    ({"Hips": ("A",)}, {"left_asis": ("B",)}, "landmark on 'B'"),
    ({}, {}, "no segment"),
])
def test_what_is_wrong_with_a_set_is_said(segments, landmarks, what):
    with pytest.raises(InputError, match=what):
        MarkerSet("own", segments, landmarks)


def test_a_trial_that_lacks_an_arm_is_still_of_its_set():
    sets = read_shipped_sets()
    driveline = next(one for one in sets if one.name == "driveline")
    arm = ("RUPA", "RELB", "RMELB", "RFRM", "RWRA", "RWRB", "RFIN")
    labels = [label for label in driveline.labels if label not in arm]
    assert choose_marker_set(labels, sets) is driveline
    assert driveline.list_missing(labels) == ("RELB", "RMELB", "RWRA", "RWRB", "RFIN")
    assert choose_marker_set([label for label in driveline.labels if "MEL" not in label and "MKN" not in label
                              and "MAN" not in label], sets).name == "plug_in_gait"  # fmt: skip


def test_labels_under_other_names_are_not_lacking():
    assert LARGE.list_missing(["lasi", "R_ASI", "SACR"]) == ("LELB",)
