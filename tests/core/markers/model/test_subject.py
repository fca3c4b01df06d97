"""Sessions of one subject get one skeleton; their markers stay where they lay on the body."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.markers.files.marker_set_text import choose_set
from beyond_mocap.markers.model.assemble import build_model_from_frame, merge_session_models
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.ground_truth.synthetic_markers import build_trial


@pytest.fixture(scope="module")
def model():
    known = build_trial(build_gait(1.3, 0.3, 50.0), "plug_in_gait", seed=1)
    frame = dict(zip(known.static.labels, known.static.positions.mean(axis=0)))
    return build_model_from_frame(frame, choose_set("plug_in_gait"), session="monday")


def with_offsets(model, offsets, **more):
    old = model.skeleton
    return replace(model, skeleton=Skeleton(old.names, old.parents, offsets, old.end_parents, old.end_offsets), **more)


def test_one_session_stays_as_it_is(model):
    (out,) = merge_session_models([model])
    assert np.allclose(out.places, model.places) and np.allclose(out.skeleton.offsets, model.skeleton.offsets)


def test_lengths_are_averaged_and_the_surer_counts_more(model):
    knee = model.skeleton.index("LeftLeg")
    longer = model.skeleton.offsets.copy()
    longer[knee] *= 1.1
    two = merge_session_models([model, with_offsets(model, longer, sessions=("tuesday",))])
    assert np.allclose(two[0].skeleton.offsets[knee], 1.05 * model.skeleton.offsets[knee])
    assert two[0].skeleton is two[1].skeleton and two[0].sessions == ("monday", "tuesday")
    unsure = model.centre_sigma.copy()
    unsure[knee] *= 10.0
    sure = merge_session_models([model, with_offsets(model, longer, centre_sigma=unsure)])
    assert np.linalg.norm(sure[0].skeleton.offsets[knee] - model.skeleton.offsets[knee]) < 0.002
    marker = model.markers.index("LKNE")
    gap = [m.places[marker] - m.skeleton.offsets[knee] for m in (model, two[0], two[1])]
    assert np.allclose(gap[0][2], gap[1][2], atol=0.002)


def test_a_pelvis_that_was_seen_turned_is_turned_back(model):
    hips = model.skeleton.index("Hips")
    turn = quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.radians(8.0))
    offsets, places = model.skeleton.offsets.copy(), model.places.copy()
    below, mine = list(model.skeleton.children(hips)), model.joint == hips
    offsets[below] = quaternion.rotate(turn, offsets[below])
    places[mine] = quaternion.rotate(turn, places[mine])
    one, other = merge_session_models([model, with_offsets(model, offsets, places=places)])
    assert np.allclose(one.places[mine], other.places[mine], atol=2e-3)
    lengths = np.linalg.norm(one.skeleton.offsets[below], axis=1)
    assert np.allclose(lengths, np.linalg.norm(model.skeleton.offsets[below], axis=1), atol=2e-3)


def test_other_joints_and_no_models_are_refused(model):
    with pytest.raises(InputError, match="no models"):
        merge_session_models([])
    names = tuple("Tail" if name == "Head" else name for name in model.skeleton.names)
    old = model.skeleton
    other = replace(model, skeleton=Skeleton(names, old.parents, old.offsets, old.end_parents, old.end_offsets))
    with pytest.raises(InputError, match="Tail"):
        merge_session_models([model, other])
