"""Calibrated models against planted truth: joint centres and angles, with and without a static trial."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError, UserCancelledError
from beyond_mocap.markers.files.marker_set_text import choose_set
from beyond_mocap.markers.model.calibrate import build_from_static, calibrate
from beyond_mocap.markers.pose.pose import PoseSettings, solve_poses
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.ground_truth.synthetic_markers import build_trial

LIMBS = [side + part for side in ("Left", "Right") for part in ("UpLeg", "Leg", "Foot", "Arm", "ForeArm", "Hand")]


@pytest.fixture(scope="module")
def walk():
    """A walk with Plug-in Gait's markers on soft skin, 2 s at 50 frames a second."""
    return build_trial(build_gait(1.4, 2.0, fps=50.0), "plug_in_gait", seed=1)


def labelled(trial, marker_set):
    return trial.rename_labels(marker_set.map_labels(trial.labels))


def joint_errors(known, model):
    """Root mean square distance (m) of each limb joint from its true centre over the trial."""
    solved = solve_poses(model, known.trial, PoseSettings(weights=False)).motion
    places = forward_kinematics(solved)[0]
    return {
        name: np.sqrt(np.mean(np.sum((places[:, solved.skeleton.index(name)] - known.centre(name)) ** 2, axis=-1)))
        for name in LIMBS
    }


def test_joints_come_back_within_ten_millimetres_with_a_static_trial(walk):
    marker_set = choose_set("plug_in_gait")
    errors = joint_errors(walk, calibrate(marker_set, walk.trial, walk.static))
    assert np.mean(list(errors.values())) < 0.007 and max(errors.values()) < 0.012


def test_joints_come_back_within_ten_millimetres_from_the_motion_itself(walk):
    errors = joint_errors(walk, calibrate(choose_set("plug_in_gait"), walk.trial))
    assert np.mean(list(errors.values())) < 0.010 and max(errors.values()) < 0.018


def test_the_motion_corrects_a_model_that_is_wrong(walk):
    """Markers on bare bone: residuals of the predicted model are millimetres, those of the refined one noise."""
    bare = build_trial(build_gait(1.4, 2.0, fps=50.0), "driveline", seed=2, softness=0.0)
    marker_set = choose_set("driveline")
    residual = [
        np.sqrt(np.nanmean(solve_poses(model, bare.trial, PoseSettings(weights=False)).residual ** 2))
        for model in (build_from_static(marker_set, bare.static), calibrate(marker_set, bare.trial, bare.static))
    ]
    assert residual[1] < 0.0012 and residual[1] < 0.6 * residual[0]


def test_bones_of_limbs_stay_along_their_axes(walk):
    skeleton = calibrate(choose_set("plug_in_gait"), walk.trial, walk.static).skeleton
    for name, axis in (("LeftForeArm", 1), ("RightHand", 1), ("LeftLeg", 2), ("RightFoot", 2)):
        offset = np.delete(skeleton.offsets[skeleton.index(name)], axis)
        assert np.abs(offset).max() < 1e-9


def test_a_marker_that_the_static_trial_lacks_is_placed_by_the_motion(walk):
    marker_set = choose_set("plug_in_gait")
    rest = [label for label in walk.static.labels if label not in ("LFIN", "RTIB")]
    model = calibrate(marker_set, walk.trial, walk.static.select_markers(rest))
    whole = calibrate(marker_set, walk.trial, walk.static)
    assert model.freedom.free[model.skeleton.index("LeftHand")].any()
    for label in ("LFIN", "RTIB"):
        place, wanted = (m.places[m.markers.index(label)] for m in (model, whole))
        assert np.linalg.norm(place - wanted) < 0.02
    assert any("LFIN" in note for note in model.notes)


def test_a_static_trial_without_a_pelvis_is_refused(walk):
    marker_set = choose_set("plug_in_gait")
    rest = [label for label in walk.static.labels if label[1:] not in ("ASI", "PSI")]
    with pytest.raises(InputError, match="pelvis"):
        calibrate(marker_set, walk.trial, walk.static.select_markers(rest))


def test_it_stops_when_the_user_wants_out(walk):
    with pytest.raises(UserCancelledError):
        calibrate(choose_set("plug_in_gait"), walk.trial, walk.static, cancelled=lambda: True)


def test_markers_that_are_seen_are_not_reported_as_seen_nowhere(walk):
    marker_set = choose_set("plug_in_gait")
    positions = np.array(walk.static.positions)
    positions[:, [walk.static.index_of(label) for label in ("C7", "T10", "CLAV", "STRN", "RBAK")]] = np.nan
    notes = calibrate(marker_set, walk.trial, walk.static.with_positions(positions)).notes
    assert not any("seen nowhere" in note for note in notes)
    assert any("not on the model" in note and "STRN" in note and "LELB" in note for note in notes)
