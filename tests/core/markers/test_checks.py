"""Mirrored markers, exchanged sides, another body's static, nobody there: told apart."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError, line_spans
from beyond_mocap.markers.checks import check_trial, report_unused
from beyond_mocap.markers.files.marker_set_text import choose_set
from beyond_mocap.markers.model.assemble import build_model_from_frame
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.ground_truth.synthetic_markers import build_trial, mirror_trial

SET = choose_set("plug_in_gait")


def sides_exchanged(trial):
    """The trial with every left label on the right marker and the other way round."""
    other = {"L": "R", "R": "L"}
    twins = {label: other.get(label[0], label[0]) + label[1:] for label in trial.labels}
    return trial.rename_labels({label: twin for label, twin in twins.items() if twin != label and twin in trial.labels})


@pytest.fixture(scope="module")
def known():
    return build_trial(build_gait(1.5, 2.0, 50.0), "plug_in_gait", seed=1)


@pytest.fixture(scope="module")
def clusters(known):
    return SET.select_clusters(known.trial.labels)


def test_a_body_and_its_static_pass(known, clusters):
    assert check_trial(known.trial, known.static, clusters) == ()
    assert check_trial(known.trial, None, clusters) == ()


@pytest.mark.parametrize("spoil, found", [
    (mirror_trial, "coordinates are mirrored"), (sides_exchanged, "labels are exchanged"),
])
def test_mirrored_is_distinguished_from_exchanged_where_the_static_shows_it(known, clusters, spoil, found):
    with pytest.raises(InputError, match=found):
        check_trial(spoil(known.trial), known.static, clusters)
    with pytest.raises(InputError, match=f"{known.static.name}.*{found}"):
        check_trial(known.trial, spoil(known.static), clusters)


def test_mirrored_markers_are_reported_where_trial_and_static_have_one_name(known, clusters):
    static = replace(known.static, name=known.trial.name)
    with pytest.raises(InputError, match="coordinates are mirrored"):
        check_trial(mirror_trial(known.trial), static, clusters)


@pytest.mark.parametrize("spoil", [mirror_trial, sides_exchanged])
def test_without_a_static_it_is_reported_as_mirrored(known, clusters, spoil):
    with pytest.raises(InputError, match="mirrored"):
        check_trial(spoil(known.trial), None, clusters)


def smaller(trial, share):
    return trial.with_positions(trial.positions * share)


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_another_bodys_static_is_refused(known, clusters, share):
    with pytest.raises(InputError, match="another body"):
        check_trial(known.trial, smaller(known.static, share), clusters)


def test_another_bodys_model_is_refused(known, clusters):
    frame = dict(zip(known.static.labels, known.static.positions.mean(axis=0)))
    assert check_trial(known.trial, None, clusters, build_model_from_frame(frame, SET)) == ()
    large = build_model_from_frame({label: 1.12 * place for label, place in frame.items()}, SET)
    with pytest.raises(InputError, match="model"):
        check_trial(known.trial, None, clusters, large)


def test_one_marker_attached_again_is_reported(known, clusters):
    moved = np.array(known.static.positions)
    moved[:, known.static.index_of("LWRA")] += [0.05, 0.0, 0.0]
    moved[:, known.static.index_of("LASI")] += [0.0, 0.06, 0.0]
    lines = check_trial(known.trial, known.static.with_positions(moved), clusters)
    assert len(lines) == 1 and "attached again" in lines[0]


def test_stretches_without_markers_are_reported_with_their_seconds(known, clusters):
    positions = np.array(known.trial.positions)
    positions[20:40] = np.nan
    (line,) = check_trial(known.trial.with_positions(positions), None, clusters)
    assert "no markers" in line and line_spans(line)[0] == pytest.approx((0.4, 0.78))
    with pytest.raises(InputError, match="none"):
        check_trial(known.trial.with_positions(np.full_like(positions, np.nan)), None, clusters)


def test_a_static_that_lacks_markers_is_reported_or_refused(known, clusters):
    without = [label for label in known.static.labels if label not in ("LKNE", "RKNE")]
    assert any("LKNE, RKNE" in line for line in check_trial(known.trial, known.static.select_markers(without),
                                                            clusters))
    with pytest.raises(InputError, match="of the trial's"):
        check_trial(known.trial, known.static.select_markers(["LASI", "RASI", "LPSI", "RPSI", "C7", "CLAV", "LHEE",
                                                              "LTOE"]), clusters)


def test_markers_of_no_segment_are_reported(known, clusters):
    assert report_unused(known.trial, clusters) == []
    strange = known.trial.rename_labels({"LWRA": "STICK", "RWRA": "*4"})
    assert report_unused(strange, clusters) == ["markers without a segment are not used: STICK"]
    assert report_unused(strange, clusters, ["STICK"]) == []


def test_a_static_in_which_nothing_is_seen_is_refused_as_that(known, clusters):
    for static in (known.static.with_positions(known.static.positions * np.nan), known.static.select_frames(0, 0)):
        with pytest.raises(InputError, match="no marker is visible"):
            check_trial(known.trial, static, clusters)


def test_few_markers_are_not_reported_as_none(known, clusters):
    pelvis = [known.trial.index_of(label) for label in ("LASI", "RASI", "LPSI", "RPSI")]
    positions = np.full_like(known.trial.positions, np.nan)
    positions[:, pelvis] = known.trial.positions[:, pelvis]
    (line,) = check_trial(known.trial.with_positions(positions), None, clusters)
    assert line.startswith("hardly any markers from")
