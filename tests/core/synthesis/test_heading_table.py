"""Heading keys as a table: read as written, and every mistake told with its line."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.synthesis.heading_request import HeadingKey
from beyond_mocap.synthesis.heading_table import read_heading_keys

HEADER = "time_s,heading_deg,x_m,y_m,hold_s\n"


def test_a_table_is_read_as_it_is_meant(tmp_path):
    file = tmp_path / "headings.csv"
    file.write_text(HEADER + "2.5,90,,,0.5\n4,,10,-3,\n", encoding="utf-8")
    assert read_heading_keys(file) == (HeadingKey(2.5, np.radians(90.0), hold=0.5), HeadingKey(4.0, target=(10, -3)))
    file.write_text("time_s,heading_deg\n4,-180\n", encoding="utf-8")
    assert read_heading_keys(file) == (HeadingKey(4.0, np.radians(-180.0)),)


@pytest.mark.parametrize("row, part", [
    ("x,90,,,", "time_s 'x'"), ("2,,,,1", "no heading; expected either heading_deg, or x_m and y_m"),
    ("2,90,1,2,", "heading_deg, x_m, y_m; expected either"), ("2,,1,,", "x_m; expected either"),
    ("2,east,,,", "heading_deg 'east'"), ("2,90,,,-1", "a hold of -1 s; expected 0 s or more"), ("2,90", "2 cells"),
])
def test_mistakes_name_their_line(tmp_path, row, part):
    file = tmp_path / "headings.csv"
    file.write_text(HEADER + "2.5,90,,,0.5\n" + row + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="headings.csv:3") as caught:
        read_heading_keys(file)
    assert part in str(caught.value) and "\n" not in str(caught.value)


def test_a_table_without_times_is_refused(tmp_path):
    file = tmp_path / "headings.csv"
    file.write_text("heading_deg\n90\n", encoding="utf-8")
    with pytest.raises(InputError, match="no column time_s"):
        read_heading_keys(file)


def test_an_unknown_column_is_named(tmp_path):
    file = tmp_path / "headings.csv"
    file.write_text("time_s,heading_deg,hold\n2,90,1\n", encoding="utf-8")
    with pytest.raises(InputError, match="headings.csv:1: unknown column hold; expected some of time_s"):
        read_heading_keys(file)
