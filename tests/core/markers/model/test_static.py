"""A static trial as one frame: what sways is not shrunk, what is hidden for a while is there, who walks is refused."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.markers.model.assemble import average_static_frame, find_stillest_frames
from beyond_mocap.markers.trial import MarkerTrial
from beyond_mocap.motion import quaternion
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.ground_truth.synthetic_markers import build_trial


@pytest.fixture(scope="module")
def known():
    return build_trial(build_gait(1.4, 1.0, fps=100.0), "driveline", seed=3)


def clusters_of(known):
    out = {}
    for label, joint in known.segments.items():
        out.setdefault(joint, []).append(label)
    return out


def distances(places, clusters):
    """All distances within segments, m."""
    groups = [np.array([places[x] for x in group]) for group in clusters.values()]
    return np.concatenate([np.linalg.norm(group[:, None] - group, axis=-1).ravel() for group in groups])


def swaying(known, degrees):
    """The static trial with its left arm lifted and lowered, as one that does not stand quite still."""
    trial, clusters = known.static, clusters_of(known)
    positions = np.array(trial.positions)
    arm = [trial.index_of(x) for joint in ("LeftArm", "LeftForeArm", "LeftHand") for x in clusters[joint]]
    about = positions[:, trial.index_of("LSHO")].mean(axis=0)
    angle = np.radians(degrees) * np.sin(np.linspace(0.0, 12.0, len(positions)))
    turn = quaternion.to_matrix(quaternion.from_axis_angle(np.array([1.0, 0.0, 0.0]), angle))
    positions[:, arm] = np.einsum("tij,tnj->tni", turn, positions[:, arm] - about) + about
    return trial.with_positions(positions)


def test_segments_keep_their_size_where_an_arm_sways_and_averaged_places_would_shrink(known):
    clusters = clusters_of(known)
    true = distances({label: known.static.positions[:, i].mean(axis=0) for i, label in enumerate(known.static.labels)},
                     clusters)
    trial = swaying(known, 20.0)
    plain = distances({label: trial.positions[:, i].mean(axis=0) for i, label in enumerate(trial.labels)}, clusters)
    off = np.abs(distances(average_static_frame(trial, clusters, 3.0), clusters) - true)
    assert off.max() < 0.002 < 0.005 < np.abs(plain - true).max()


def test_it_lies_where_the_body_stands(known):
    frame = average_static_frame(known.static, clusters_of(known))
    first, end = find_stillest_frames(known.static)
    middle = np.mean(known.static.positions[first:end], axis=0)
    off = [np.linalg.norm(frame[label] - middle[i]) for i, label in enumerate(known.static.labels)]
    assert max(off) < 0.006


def test_markers_hidden_for_a_while_and_lone_ones_have_their_place(known):
    trial = known.static
    positions = np.array(trial.positions)
    positions[: len(positions) - 20, trial.index_of("LFIN")] = np.nan
    positions[::2, trial.index_of("LASI")] = np.nan
    positions[:, trial.index_of("RBAK")] = np.nan
    frame = average_static_frame(trial.with_positions(positions), clusters_of(known), 3.0)
    whole = average_static_frame(trial, clusters_of(known), 3.0)
    assert np.linalg.norm(frame["LFIN"] - whole["LFIN"]) < 0.02
    assert np.linalg.norm(frame["LASI"] - whole["LASI"]) < 0.001
    assert np.isnan(frame["RBAK"]).all()
    assert set(frame) == set(trial.labels)


def test_the_stillest_stretch_is_found(known):
    trial = known.static
    positions = np.array(trial.positions)
    positions[:150] += np.linspace(1.0, 0.0, 150)[:, None, None]
    first, end = find_stillest_frames(trial.with_positions(positions), 1.0)
    assert first >= 145 and end - first == 100


def test_a_walking_person_is_no_static(known):
    with pytest.raises(InputError, match="stillest"):
        average_static_frame(known.trial, clusters_of(known))


def test_without_segments_places_are_averaged(known):
    trial = MarkerTrial(labels=("A",), positions=np.full((10, 1, 3), 0.5), fps=100.0)
    np.testing.assert_allclose(average_static_frame(trial, {})["A"], 0.5)
