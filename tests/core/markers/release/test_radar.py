"""A speed is read out of a file's name only where it is one for certain."""

import pytest

from beyond_mocap.markers.release.radar_speed import parse_radar_speed


@pytest.mark.parametrize("name, speed", [
    ("000870_003252_74_195_002_FF_808", 36.12),
    ("001234_000001_72_210_011_CU_1003", 44.84),
    ("throw_130kmh", 36.11),
    ("throw-36.1mps", 36.1),
    ("ff_81mph_3", 36.21),
    ("fast 36p1 m_s", 36.1),
    ("s1_95_KPH", 26.39),
])
def test_speeds_are_read(name, speed):
    assert parse_radar_speed(name) == pytest.approx(speed, abs=0.01)


@pytest.mark.parametrize("name", [
    "pitch_biodata", "sprinter_run0350cms", "throw_808", "000870_003252_74_195_002_FF_8080", "trial_300kmh",
    "a_81mph_90mph", "000870_003252_74_195_002_FF_010", "", "throw_3ms",
])
def test_other_numbers_are_no_speed(name):
    assert parse_radar_speed(name) is None
