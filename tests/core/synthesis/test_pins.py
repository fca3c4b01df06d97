"""Pins as a table: read as written, and every mistake told with its line."""

import re

import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.synthesis.pin_table import read_pins
from beyond_mocap.synthesis.plan import Pin, Plan

HEADER = "time_s,part,x_m,y_m,z_m,hold_s\n"


def test_a_table_is_read_as_it_is_meant(tmp_path):
    file = tmp_path / "pins.csv"
    file.write_text(HEADER + "2.5,Left_Hand,1,2,1.4,0.5\n4,gaze,10,0,2,\n", encoding="utf-8")
    assert read_pins(file) == (Pin(2.5, "left_hand", (1, 2, 1.4), 0.5), Pin(4, "gaze", (10, 0, 2)))
    file.write_text("time_s,part,x_m,y_m,z_m\n4,gaze,10,0,2\n", encoding="utf-8")
    assert read_pins(file) == (Pin(4, "gaze", (10, 0, 2)),)


@pytest.mark.parametrize("row, part", [
    ("2.5,tail,1,2,3,0", "'tail'"), ("x,gaze,1,2,3,0", "time_s 'x'"), ("2,gaze,1,,3,0", "y_m ''"),
    ("2,gaze,1,nan,3,0", "y_m 'nan'"), ("2,gaze,1,1e308,3,0", "y_m 1e308; expected metres"),
    ("2,gaze,1,2,3,-1", "a hold of -1 s"),
    ("2,ball,1,2,0.11,0.5", "a hold of 0.5 s; expected 0 s for the ball"),
])
def test_mistakes_name_their_line(tmp_path, row, part):
    file = tmp_path / "pins.csv"
    file.write_text(HEADER + "2.5,left_hand,1,2,1.4,0.5\n" + row + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="pins.csv:3") as caught:
        read_pins(file)
    told = str(caught.value)
    assert part in told and "\n" not in told and re.search("; (correct|check) the ", told)


def test_a_table_without_its_columns_is_refused(tmp_path):
    file = tmp_path / "pins.csv"
    file.write_text("time_s,part\n", encoding="utf-8")
    with pytest.raises(InputError, match="no column x_m, y_m, z_m; expected .+; add the columns"):
        read_pins(file)


def test_one_part_is_at_one_place_at_a_time(track_of):
    with pytest.raises(InputError, match="two pins of gaze at 2 s"):
        Plan(track=track_of(), pins=(Pin(1, "gaze", (0, 0, 0), 1.5), Pin(2, "gaze", (1, 0, 0))))
    late, early = Pin(2, "gaze", (0, 0, 0)), Pin(1, "gaze", (1, 0, 0))
    assert Plan(track=track_of(), pins=(late, early)).pins == (early, late)
