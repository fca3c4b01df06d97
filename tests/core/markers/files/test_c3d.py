"""C3D files of every kind are read as they were made, and damaged ones are told in one line."""

import io
import struct
import sys
import tracemalloc

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from beyond_mocap.markers.files.marker_files import read_markers
from beyond_mocap.markers.trial import MarkerEvent


@pytest.fixture
def read(tmp_path):
    """Writes bytes and reads them as a trial."""

    def read_bytes(data, **options):
        (tmp_path / "made.c3d").write_bytes(data)
        return read_markers(tmp_path / "made.c3d", **options)

    return read_bytes


def texts(*values, width=12):
    """The data and dimensions of a text parameter."""
    return b"".join(value.encode().ljust(width) for value in values), -1, (width, len(values))


@pytest.mark.parametrize("processor", [84, 85, 86])
@pytest.mark.parametrize("scale", [-1.0, 0.1])
def test_every_kind_of_number(body, read, processor, scale):
    factor = 1.0 if scale < 0 else 1000.0
    trial = read(body.c3d(body.positions * factor, body.labels, scale, processor=processor,
                          unit="m" if scale < 0 else "mm", analog=3))  # fmt: skip
    assert trial.labels == body.labels and trial.fps == 100
    np.testing.assert_allclose(trial.positions, body.positions, atol=1e-6 if scale < 0 else 5.1e-5)
    assert trial.notes == (f"unit {'m' if scale < 0 else 'mm'}", "Z is up, heads above feet")


@pytest.mark.filterwarnings("ignore")
def test_the_same_as_the_package_reads(body, read):
    import c3d

    data = body.c3d(body.positions, body.labels, residual=2.0)
    points = np.array([points for _, points, _ in c3d.Reader(io.BytesIO(data)).read_frames()])
    points[points[..., 3] < 0] = np.nan
    trial = read(data)
    np.testing.assert_array_equal(trial.positions, points[..., :3])
    np.testing.assert_array_equal(trial.residuals, points[..., 3])


@pytest.mark.filterwarnings("ignore")
def test_a_file_that_the_package_wrote(body, read):
    import c3d

    writer, out = c3d.Writer(point_rate=50.0, point_units="mm  "), io.BytesIO()
    writer.set_point_labels(list(body.labels))
    for frame in np.nan_to_num(body.positions):
        points = np.zeros((len(body.labels), 5), np.float32)
        points[:, :3] = 1000 * frame
        writer.add_frames((points, np.zeros((0, 0))))
    writer.write(out)
    trial = read(out.getvalue())
    assert trial.fps == 50 and trial.labels == body.labels
    np.testing.assert_allclose(trial.positions, body.positions, atol=1e-6)


def test_residuals_are_metres_and_only_where_seen(body, read):
    trial = read(body.c3d(body.positions * 1000, body.labels, unit="mm", residual=3.0))
    assert np.isnan(trial.residuals[5, body.index("LKNE")])
    np.testing.assert_allclose(np.nanmax(trial.residuals), 0.003)
    assert read(body.c3d(body.positions, body.labels)).residuals is None


def test_zeros_and_no_numbers_are_not_seen(body, read):
    body.positions[3, 0] = 0.0
    data = bytearray(body.c3d(body.positions, body.labels))
    assert not read(bytes(data)).visibility[3, 0]
    start = 512 * (struct.unpack_from("<H", data, 16)[0] - 1)
    struct.pack_into("<f", data, start + 16, float("nan"))
    struct.pack_into("<f", data, start + 32, 1e38)
    trial = read(bytes(data))
    assert not trial.visibility[0, 1] and not trial.visibility[0, 2] and trial.visibility[0, 3]
    assert any("farther than" in note for note in trial.notes)


@pytest.mark.parametrize("unit, factor", [
    ("mm", 1e3), ("cm", 1e2), ("in", 1 / 0.0254), ("Meters", 1.0), ("", 1e3), ("furlong", 100.0), ("", 1 / 0.0254),
])  # fmt: skip
def test_units(body, read, unit, factor):
    trial = read(body.c3d(body.positions * factor, body.labels, unit=unit))
    np.testing.assert_allclose(trial.positions, body.positions, atol=1e-5)
    assert ("taken as" in trial.notes[0]) == (unit in ("", "furlong"))


def test_a_unit_that_cannot_be(body, read):
    data = body.c3d(body.positions, body.labels, unit="mm")
    with pytest.raises(InputError, match="a body of 0.00.* m in the header's unit 'mm'.*set the unit"):
        read(data)
    np.testing.assert_allclose(read(data, unit=1).positions, body.positions, atol=1e-6)
    np.testing.assert_allclose(read(data, unit="m").positions, body.positions, atol=1e-6)
    assert any("the markers then span" in note for note in read(data, unit=12).notes)
    assert "unit 1 m, as given" in read(data, unit="m").notes
    for said, true in (("mm", 100), ("cm", 1000), ("in", 1000), ("m", 1 / 0.0254)):  # centimetres called mm ...
        with pytest.raises(InputError, match="a body of .*set the unit"):
            read(body.c3d(body.positions * true, body.labels, unit=said))
    with pytest.raises(InputError, match="no unit, and markers that span .*set the unit"):
        read(body.c3d(body.positions * 1e6, body.labels, unit=""))
    with pytest.raises(InputError, match="unit 'parsec'"):
        read(data, unit="parsec")
    with pytest.raises(InputError, match="unit 1000: makes .* span 1660 m"):
        read(data, unit="1000")


TURNED = {"+Z": ((0, 1, 2), (1, 1, 1)), "+Y": ((0, 2, 1), (1, 1, -1)), "-Y": ((0, 2, 1), (1, -1, 1)),
          "+X": ((2, 0, 1), (1, 1, 1)), "-X": ((2, 0, 1), (-1, -1, 1)), "-Z": ((0, 1, 2), (1, -1, -1))}  # fmt: skip


@pytest.mark.parametrize("up", TURNED)
@pytest.mark.parametrize("said", [True, False])
def test_what_is_up(body, read, up, said):
    axes, signs = TURNED[up]
    more = [(1, "Y_SCREEN", *texts(up))] if said else []
    trial = read(body.c3d(body.positions[..., axes] * signs, body.labels, more=more))
    heights = np.nanmean(trial.positions[..., 2], axis=0)
    np.testing.assert_allclose(heights, np.nanmean(body.positions[..., 2], axis=0), atol=1e-6)
    assert not any("mirrored" in note or "check which" in note for note in trial.notes)
    apart = np.linalg.norm(trial.positions - trial.positions[:, :1], axis=-1)
    np.testing.assert_allclose(apart, np.linalg.norm(body.positions - body.positions[:, :1], axis=-1), atol=1e-5)


def test_a_header_that_has_the_body_lying_is_reported(body, read):
    trial = read(body.c3d(body.positions, body.labels, more=[(1, "Y_SCREEN", *texts("+Y"))]))
    assert any("check which way is up" in note for note in trial.notes)


def test_a_lying_body_is_left_lying_where_one_says_so(body, read):
    lying = body.positions[..., [2, 1, 0]] * [1, 1, -1]
    assert "X is up, heads above feet" in read(body.c3d(lying, body.labels)).notes
    trial = read(body.c3d(lying, body.labels), up="Z")
    np.testing.assert_allclose(trial.positions, lying, atol=1e-6)
    assert "Z is up, as given" in trial.notes
    np.testing.assert_allclose(read(body.c3d(lying, body.labels), up="-x").positions[..., 2], -lying[..., 0], atol=1e-6)
    for wrong in ("W", "", "ZZ", "Z-"):
        with pytest.raises(InputError, match="up axis: axis"):
            read(body.c3d(lying, body.labels), up=wrong)


def test_mirrored_bodies_are_reported(body, read):
    trial = read(body.c3d(body.positions * [1, -1, 1], body.labels))
    assert any("mirrored" in note for note in trial.notes)


def test_angles_and_computed_points_are_left_out(body, read):
    more = [f"{name}{letter}" for name in ("PEL", "LFE") for letter in "OALP"] + ["CentreOfMass", "LHipAngles", "Odd"]
    positions = np.concatenate([body.positions, np.ones((12, len(more), 3))], axis=1)
    listed = [(1, "ANGLES", *texts("Odd"))]
    trial = read(body.c3d(positions, [*body.labels, *more], more=listed))
    assert trial.labels == body.labels
    assert any("11 computed points left out: PELO" in note for note in trial.notes)
    with pytest.raises(InputError, match="no markers"):
        read(body.c3d(positions[:, -2:], more[-2:], more=listed))


def test_one_subject_of_a_file(body, read):
    labels = [f"Jo:{label}" for label in body.labels]
    trial = read(body.c3d(body.positions, labels))
    assert (trial.subject, trial.labels) == ("Jo", body.labels)
    with pytest.raises(InputError, match="its labels name no subject; leave the subject empty"):
        read(body.c3d(body.positions, body.labels), subject="Jo")


def test_several_subjects(body, read):
    labels = [f"Jo:{label}" for label in body.labels] + [f"Di:{label}" for label in body.labels] + ["Puck:P", "*1"]
    positions = np.concatenate([body.positions, body.positions + 1, np.ones((12, 2, 3))], axis=1)
    data = body.c3d(positions, labels)
    with pytest.raises(InputError, match="'Jo' .17 markers., 'Di' .17 markers.*choose one subject"):
        read(data)
    trial = read(data, subject="di")
    assert trial.subject == "Di" and trial.labels == (*body.labels, "Puck:P", "*1")
    np.testing.assert_allclose(trial.positions[:, :17], body.positions + 1, atol=1e-6)
    with pytest.raises(InputError, match="no subject 'Al'; expected one of 'Jo'"):
        read(data, subject="Al")


def test_an_object_beside_a_body_needs_no_choice(body, read):
    labels = [f"Jo:{label}" for label in body.labels] + ["Puck:P"]
    trial = read(body.c3d(np.concatenate([body.positions, np.ones((12, 1, 3))], axis=1), labels))
    assert trial.subject == "Jo" and trial.labels[-1] == "Puck:P"


def test_prefixes_that_the_file_names(body, read):
    more = [(3, "LABEL_PREFIXES", *texts("Jo_"))]
    trial = read(body.c3d(body.positions, [f"Jo_{label}" for label in body.labels], more=more, groups=["SUBJECTS"]))
    assert (trial.subject, trial.labels) == ("Jo", body.labels)


def test_labels_that_come_twice_or_not_at_all(body, read):
    labels = ["C7", "C7", "", "", *body.labels[4:]]
    trial = read(body.c3d(body.positions, labels))
    assert trial.labels[:4] == ("C7", "C7 (2)", "*1", "*2")
    assert any("duplicate labels, numbered: C7" in note for note in trial.notes)


def test_labels_that_go_on_in_a_second_list(body, read):
    assert read(body.c3d(body.positions, body.labels, split=10)).labels == body.labels


def test_points_without_labels_are_reported(body, read):
    data = body.c3d(body.positions, body.labels, split=10).replace(b"LABELS2", b"LABELSX")
    trial = read(data)
    assert trial.labels[9:12] == (body.labels[9], "*1", "*2")
    assert "7 of 17 points have no label" in trial.notes


def test_markers_never_seen_are_left_out(body, read):
    body.positions[:, 2] = np.nan
    trial = read(body.c3d(body.positions, body.labels))
    assert "C7" not in trial.labels and any("never visible: C7" in note for note in trial.notes)
    body.positions[:] = np.nan
    with pytest.raises(InputError, match="none ever visible|no unit"):
        read(body.c3d(body.positions, body.labels))


def test_events_and_the_clock(body, read):
    more = [(3, "USED", struct.pack("<H", 2), 2, ()), (3, "LABELS", *texts("Foot Strike", "Release")),
            (3, "CONTEXTS", *texts("Right", "General")),
            (3, "TIMES", np.array([0, 7.31, 1, 0.5], "<f4").tobytes(), 4, (2, 2))]  # fmt: skip
    trial = read(body.c3d(body.positions, body.labels, first=725, more=more, groups=["EVENT"]))
    assert trial.start == pytest.approx(7.24)
    assert [(event.label, event.side) for event in trial.events] == [("Foot Strike", "right"), ("Release", "")]
    np.testing.assert_allclose([event.seconds for event in trial.events], [7.31, 60.5], atol=1e-6)


def test_events_of_the_header(body, read):
    data = bytearray(body.c3d(body.positions, body.labels, header={298: 0x3039, 300: 1}))
    struct.pack_into("<f", data, 304, 0.05)
    data[304 + 72], data[304 + 92 : 304 + 96] = 1, b"BALL"
    assert read(bytes(data)).events == (MarkerEvent(pytest.approx(0.05), "BALL", ""),)


def test_more_events_in_the_header_than_it_can_hold(body, read):
    assert read(body.c3d(body.positions, body.labels, header={300: 60000})).events == ()


def test_header_and_parameters_that_disagree(body, read):
    for at, value in ((2, 99), (4, 50), (8, 4000), (16, 9)):
        trial = read(body.c3d(body.positions, body.labels, header={at: value}))
        np.testing.assert_allclose(trial.positions, body.positions, atol=1e-6)
        assert any("disagree" in note for note in trial.notes), at


def test_frames_beyond_what_the_header_can_count(body, read):
    long = np.tile(body.positions[:, :1], (5500, 1, 1))[:65700]
    more = [(3, "ACTUAL_START_FIELD", struct.pack("<HH", 1, 0), 2, (2,)),
            (3, "ACTUAL_END_FIELD", struct.pack("<HH", 65700 - 65536, 1), 2, (2,))]  # fmt: skip
    data = body.c3d(long, ["C7"], more=more, groups=["TRIAL"], header={8: 65535})
    assert len(read(data, unit=1)) == 65700


@pytest.mark.parametrize("data, said", [
    (b"", "an empty file"), (b"PK\3\4" * 400, "not the start of a C3D file"), (b"\2\x50", "not the start"),
    (b"\2\x50" + b"\0" * 2000, "damaged parameters"),
])  # fmt: skip
def test_files_that_are_none(read, data, said):
    with pytest.raises(InputError, match=said):
        read(data)


def test_paths_that_are_none(tmp_path):
    (tmp_path / "folder.c3d").mkdir()
    for name, said in (("missing.c3d", "no such file"), ("folder.c3d", "a folder"), ("a.csv", "ending '.csv'")):
        with pytest.raises(InputError, match=said):
            read_markers(tmp_path / name)


def test_a_file_that_is_cut_off(body, read):
    data = body.c3d(body.positions, body.labels)
    with pytest.raises(InputError, match="9 frames; expected 12 as the header says; the file is cut off"):
        read(data[: len(data) - 1024])
    with pytest.raises(InputError, match="damaged parameters"):
        read(data[:700])


@pytest.mark.parametrize("change, said", [
    ({"fps": 0.0}, "0 frames per second"), ({"fps": float("nan")}, "nan frames per second"),
    ({"scale": -0.0}, "scale -0 of the points"),
])  # fmt: skip
def test_numbers_that_cannot_be(body, read, change, said):
    data = body.c3d(body.positions, body.labels, **change) if "scale" not in change else body.c3d(
        body.positions, body.labels).replace(struct.pack("<f", -1.0), struct.pack("<f", -0.0))  # fmt: skip
    with pytest.raises(InputError, match=said):
        read(data)


def test_headers_that_promise_too_much_cost_nothing(body, read):
    huge = struct.pack("<HH", 65535, 65535)
    more = [(3, "ACTUAL_START_FIELD", struct.pack("<HH", 1, 0), 2, (2,)), (3, "ACTUAL_END_FIELD", huge, 2, (2,)),
            (1, "LONG_FRAMES", struct.pack("<f", 1e9), 4, ())]  # fmt: skip
    data = bytearray(body.c3d(body.positions, body.labels, more=more, groups=["TRIAL"], header={8: 60000}))
    at = data.index(b"FRAMES") + 6 + 4
    struct.pack_into("<H", data, at, 60000)
    bombs = body.c3d(body.positions, body.labels, more=[(1, "UNITS2", b"m" * 99, -1, (255,) * 7)])
    tracemalloc.start()
    for file, said in ((bytes(data), "cut off"), (bombs, "damaged parameters")):
        with pytest.raises(InputError, match=said):
            read(file)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20e6


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.integers(0, 4000), st.integers(0, 255)), min_size=1, max_size=12), st.integers(0, 3))
def test_any_damage_is_read_or_reported(body, read, changes, kind):
    more = [(3, "TIMES", np.array([0, 7.31], "<f4").tobytes(), 4, (2, 1)), (3, "LABELS", *texts("Foot"))]
    scale, processor = ((-1.0, 84), (0.01, 84), (-1.0, 86), (0.01, 85))[kind]
    data = bytearray(body.c3d(body.positions, body.labels, scale, processor=processor, more=more, groups=["EVENT"]))
    for at, value in changes:
        data[at % len(data) if at > 1500 else at % 1500] = value
    try:
        trial = read(bytes(data))
    except InputError as error:
        assert "\n" not in str(error) and len(str(error)) < 600
    else:
        assert np.isfinite(trial.positions[trial.visibility]).all()


def test_without_the_package_one_line_is_said(body, read, monkeypatch):
    monkeypatch.setitem(sys.modules, "c3d", None)
    with pytest.raises(InputError, match="c3d cannot be imported.*extra 'markers'"):
        read(body.c3d(body.positions, body.labels))
