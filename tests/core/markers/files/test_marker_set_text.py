"""Marker sets as text: ours are read, what is written is read again, and what is wrong is told with its line."""


import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from beyond_mocap.markers.files.marker_set_text import (
    SHIPPED,
    choose_set,
    format_marker_set,
    parse_marker_set,
    read_marker_set,
    read_shipped_sets,
)
from beyond_mocap.markers.model.marker_set import MarkerSet

TEXT = """\
# my own
Marker Set: mine
about: four markers: on a pelvis   # and a comment
segment Hips: LASI, RASI ,  Left PSI
segment Hips: R#PSI
landmark left_asis: LASI
also Left PSI: LPSI, LPSIS
static: R#PSI
ball: BALL
other: Stick 1
"""


def test_a_text_is_read():
    one = parse_marker_set(TEXT)
    assert one == MarkerSet("mine", {"Hips": ("LASI", "RASI", "Left PSI", "R#PSI")}, {"left_asis": ("LASI",)},
                            {"LPSI": "Left PSI", "LPSIS": "Left PSI"}, static=("R#PSI",), ball=("BALL",),
                            other=("Stick 1",), about="four markers: on a pelvis")  # fmt: skip


def test_line_ends_and_a_mark_at_the_start_do_not_matter(tmp_path):
    path = tmp_path / "mine.txt"
    path.write_bytes(b"\xef\xbb\xbf" + TEXT.replace("\n", "\r\n").encode())
    assert read_marker_set(path) == parse_marker_set(TEXT)


def test_ours_come_back_as_they_are(tmp_path):
    sets = read_shipped_sets()
    assert len(sets) == len(list(SHIPPED.glob("*.txt"))) >= 4
    for one in sets:
        (tmp_path / "one.txt").write_text(format_marker_set(one), encoding="utf-8")
        assert read_marker_set(tmp_path / "one.txt") == one


def test_a_set_is_chosen_by_name_or_file(tmp_path):
    (tmp_path / "mine.txt").write_text(TEXT)
    assert choose_set("Plug_in_Gait").name == "plug_in_gait"
    assert choose_set(str(tmp_path / "mine.txt")).name == "mine"
    with pytest.raises(InputError, match="marker set: no marker set 'yours'.*plug_in_gait"):
        choose_set("yours")


@pytest.mark.parametrize("line, said", [
    ("marker set: two", "x:11: a second"),
    ("marker set two", "x:11: 'marker set two'"),
    ("segment Hip: A", "no segment 'Hip'"),
    ("segment: A", "x:11: 'segment'"),
    ("landmark nose: LASI", "no landmark 'nose'"),
    ("landmark left_psis: LPSI", "which is on no segment"),
    ("colour: red", "x:11: 'colour'"),
    ("segment Head: ", "x:11: no labels"),
    ("segment Head: A,,B", "an empty label"),
    ("segment Head: Joe:A", "without a colon"),
    ("segment Head: LASI", "'LASI' on two segments"),
    ("also LASI: LPSI", "'LPSI' for 'Left PSI' and 'LASI'"),
])  # fmt: skip
def test_what_is_wrong_is_reported_with_its_line(line, said):
    with pytest.raises(InputError, match=said):
        parse_marker_set(TEXT + line, "x")


@pytest.mark.parametrize("text, said", [
    ("", "no line `marker set: NAME`"),
    ("marker set: a b\n", "x:1: name 'a b'"),
    ("marker set: a\n", "no segment"),
])  # fmt: skip
def test_what_is_missing_is_reported(text, said):
    with pytest.raises(InputError, match=said):
        parse_marker_set(text, "x")


def test_files_that_are_none(tmp_path):
    (tmp_path / "binary").write_bytes(b"\x80\0")
    for name, said in (("missing", "no such file"), (".", "a folder"), ("binary", "UTF-8")):
        with pytest.raises(InputError, match=said):
            read_marker_set(tmp_path / name)


@pytest.mark.parametrize("label", ["A,B", "A:B", "A #1", " A", "A  B"])
def test_labels_that_cannot_be_written_are_reported(label):
    with pytest.raises(InputError, match="rename it"):
        format_marker_set(MarkerSet("a", {"Hips": (label,)}))


@settings(max_examples=200, deadline=None)
@given(st.lists(st.text(alphabet="segment: Hips,ALRmark#\n\t\r about", max_size=30), max_size=8))
def test_any_text_is_a_set_or_reported(lines):
    try:
        parse_marker_set("marker set: a\nsegment Hips: A\n" + "\n".join(lines))
    except InputError as error:
        assert "\n" not in str(error)
