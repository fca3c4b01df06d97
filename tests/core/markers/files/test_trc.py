"""TRC files, tidy or not, are read as they were made; what a body would come out wrong by is told with its line."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from beyond_mocap.markers.files.marker_files import read_markers
from beyond_mocap.markers.files.trc import format_trc, write_trc
from beyond_mocap.markers.trial import MarkerTrial


@pytest.fixture
def lines(body):
    """The made body as a TRC file has it: millimetres, Y up."""
    return body.trc(1000 * body.positions[..., [0, 2, 1]] * [1, 1, -1], body.labels)


@pytest.fixture
def read(tmp_path):
    """Writes lines, text or bytes and reads them as a trial."""

    def read_lines(what, **options):
        text = what if isinstance(what, (str, bytes)) else "\n".join(list(what))
        (tmp_path / "made.trc").write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_markers(tmp_path / "made.trc", **options)

    return read_lines


def same(trial, body, atol=1e-7):
    """Whether the made body was read."""
    np.testing.assert_allclose(trial.positions, body.positions, atol=atol)
    return trial.labels == body.labels and trial.fps == 100


def test_a_tidy_file(body, lines, read):
    trial = read(lines)
    assert same(trial, body) and trial.start == 0 and not trial.visibility[5, body.index("LKNE")]
    assert trial.notes == ("unit mm", "Y is up, heads above feet")


@pytest.mark.parametrize("change", [
    lambda text: text.replace("\n", "\r\n"),
    lambda text: text.replace("\n", "\r"),
    lambda text: "\ufeff" + text,
    lambda text: text + "\n\n\n",
    lambda text: text.replace("\n", "\t\t\n"),
    lambda text: "\n".join(line.rstrip("\t") for line in text.split("\n")),
    lambda text: "\n".join(line for line in text.split("\n") if line),
    lambda text: text.replace("\t\t\n", "\n").replace("made.trc", "Mär".encode("cp1252").decode("latin-1")),
    lambda text: text.replace("\nFrame#", "\nFRAME#"),
    lambda text: text.replace("\tTime\t", "\tTime (s)\t"),
], ids=["CRLF", "CR", "BOM", "blank lines", "tabs at ends", "no tabs at ends", "no blank line", "no ends", "case",
        "unit"])  # fmt: skip
def test_untidy_ones(body, lines, read, change):
    assert same(read(change("\n".join(lines))), body)


def test_another_coding(body, lines, read):
    assert same(read("\n".join(lines).replace("made.trc", "Läufer.trc").encode("cp1252")), body)


def test_decimal_commas(body, lines, read):
    assert same(read([*lines[:5], *(line.replace(".", ",") for line in lines[5:])]), body)


@pytest.mark.parametrize("word", ["NaN", "nan", "-", "  ", "null", "inf"])
def test_missing_cells(body, lines, read, word):
    rows = ("\t".join(cell or word for cell in line.split("\t")) for line in lines[6:])
    assert same(read([*lines[:6], *rows]), body)


def test_cells_parted_by_blanks(body, lines, read):
    cells = [[cell or "NaN" for cell in line.split("\t")] if i > 5 else line.split() for i, line in enumerate(lines)]
    assert same(read("   ".join(row) for row in cells), body)


def test_labels_one_beside_the_other(body, lines, read):
    lines[3] = "Frame#\tTime\t" + "\t".join(body.labels)
    assert same(read(lines), body)


def test_axes_in_another_order(body, read):
    lines = body.trc(1000 * body.positions, body.labels)
    lines[4] = lines[4].replace("Y", "?").replace("Z", "Y").replace("?", "Z")
    assert any("mirrored" in note for note in read(lines).notes)


def test_z_up_is_seen(body, read):
    trial = read(body.trc(1000 * body.positions, body.labels))
    assert same(trial, body) and "Z is up, heads above feet" in trial.notes


def test_y_is_up_where_no_body_stands(read, body):
    trial = read(body.trc(body.positions[:, :3], ["A", "B", "D"], unit="m"), unit="m")
    np.testing.assert_allclose(trial.positions[..., 2], body.positions[:, :3, 1], atol=1e-5)
    assert "Y is up, as such files usually are" in trial.notes


def test_markers_without_a_label(body, lines, read):
    lines[3] = lines[3].replace("RTOE\t\t", "").rstrip("\t")
    assert read(lines).labels == (*body.labels[:-1], "*1")


def test_more_markers_than_said_are_reported(body, lines, read):
    lines[2] = lines[2].replace("\t17\t", "\t16\t")
    assert "17 markers, not 16 as in the header" in read(lines).notes


def test_a_file_that_ends_early_is_told_and_a_row_that_is_cut_off_left_out(body, lines, read):
    early = "6 frames, not 12 as in the header: the file ends early"
    cut = f"{early}, and its last row, which is cut off, is left out"
    for end, note in (("", early), ("\n", early), ("\n" + lines[12][:40], cut), ("\n" + lines[12][:-1], cut)):
        trial = read("\n".join(lines[:12]) + end)
        assert [line for line in trial.notes if "header" in line] == [note]
        np.testing.assert_allclose(trial.positions, body.positions[:6], atol=1e-7)
    trial = read([*lines[:2], lines[2].replace("\t12\t", "\t999999999\t"), *lines[3:]])
    assert same(trial, body) and "12 frames, not 999999999 as in the header: the file ends early" in trial.notes
    assert not [line for line in read([*lines[:8], *lines[9:]]).notes if "early" in line]  # a gap is no end


def test_frames_that_are_left_out_come_back_as_not_seen(body, lines, read):
    trial = read(lines[:10] + lines[13:])
    assert len(trial) == 12 and not trial.visibility[4:7].any() and trial.visibility[7:].all()
    assert "3 frames missing in the times, added as not visible" in trial.notes


def test_a_rate_by_the_times(body, lines, read):
    lines[2] = lines[2].replace("100.0", "60.0")
    trial = read(lines)
    assert trial.fps == 100 and "100 frames per second by the times; the header says 60" in trial.notes


@pytest.mark.parametrize("digits", [2, 3, 4])
def test_times_with_few_digits(body, read, digits):
    lines = body.trc(1000 * np.tile(body.positions, (9, 1, 1)), body.labels, fps=360.0)
    for i, line in enumerate(lines[6:], 6):
        number, time, rest = line.split("\t", 2)
        lines[i] = f"{number}\t{float(time):.{digits}f}\t{rest}"
    trial = read(lines)
    assert trial.fps == 360 and len(trial) == 108


def test_no_times_at_all(body, lines, read):
    lines[6:] = ["\t".join([cells[0], "", *cells[2:]]) for cells in (line.split("\t") for line in lines[6:])]
    trial = read(lines)
    assert same(trial, body) and any("no times" in note for note in trial.notes)


def test_the_clock_begins_where_the_file_says(body, read):
    trial = read(body.trc(1000 * body.positions, body.labels, start=3.25))
    assert trial.start == 3.25 and len(trial) == 12


def set_line(number, change):
    """Changes one line of the made file."""

    def changed(lines):
        lines[number] = change(lines[number])
        return lines

    return changed


@pytest.mark.parametrize("change, said", [
    (lambda lines: [], "an empty file"),
    (lambda lines: ["a", "b"], "made.trc:1: no line that starts with Frame#"),
    (lambda lines: ["\0\1\2"], "binary content"),
    (lambda lines: lines[:6], "no rows below the head"),
    (set_line(3, lambda line: "Frame#\tTime"), "made.trc:4: 'Frame# Time'"),
    (set_line(3, lambda line: line.replace("C7\t\t\t", "C7\t\t")), "made.trc:4: label 'LSHO' in column 11"),
    (set_line(4, lambda line: line.replace("Z1", "Q1")), "made.trc:5: 'X1 Y1 Q1 X2'"),
    (set_line(4, lambda line: "\t\tX1\tY1\tZ1"), "made.trc:5: coordinates of 1 markers; expected 17"),
    (set_line(8, lambda line: line + "\t1\t2\t3"), "made.trc:9: 54 coordinates; expected 51 for 17 markers"),
    (set_line(17, lambda line: line[:100]), "made.trc:18: .* the row is cut off"),
    (set_line(7, lambda line: line.replace("000\t1", "000\tI", 1)), "made.trc:8: 'I.*' in column 3; expected a num"),
    (set_line(9, lambda line: line.replace("0.030000", "0.010000")), "Time of frame 4 is 0.010000, after 0.020000"),
    (set_line(9, lambda line: line.replace("0.030000", "0.035000")), "off 100 frames per second.*resample"),
    (set_line(17, lambda line: line.replace("0.110000", "99990.11")), "skip 9999000 frames"),
    (lambda lines: [line.replace("100.0\t", "0\t") for line in lines[:5]] + lines[6:7], "nan frames per second"),
    (set_line(2, lambda line: line.replace("mm", "m")), "a body of 1507 m in the header's unit 'm'.*set the unit"),
])  # fmt: skip
def test_what_is_wrong_is_reported(lines, read, change, said):
    with pytest.raises(InputError, match=said):
        read(change(lines))


def test_a_written_trial_is_read_as_it_was(body, tmp_path):
    trial = MarkerTrial(labels=body.labels, positions=body.positions, fps=240.0, start=1.5, name="there")
    write_trc(trial, tmp_path / "there.trc")
    again = read_markers(tmp_path / "there.trc")
    assert (again.labels, again.fps, again.start, again.name) == (trial.labels, 240.0, 1.5, "there")
    np.testing.assert_allclose(again.positions, trial.positions, atol=1e-7)
    assert format_trc(trial).isascii()
    with pytest.raises(InputError, match="cannot be written"):
        write_trc(trial, tmp_path / "missing" / "there.trc")


CHARACTERS = st.sampled_from([*"\t\n\r -,.09eX#\0é", "nan", "\t\t\t"])


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.floats(0, 1), st.integers(0, 3), CHARACTERS), min_size=1, max_size=6))
def test_any_damage_is_read_or_reported(lines, read, changes):
    text = "\n".join(lines)
    for share, length, put in changes:
        at = int(share**2 * len(text))
        text = text[:at] + put + text[at + length :]
    try:
        trial = read(text.encode("utf-8"))
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert np.isfinite(trial.positions[trial.visibility]).all()
