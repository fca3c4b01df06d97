"""Parse the measured speed of a throw from the name of its file."""

from __future__ import annotations

import re

MPH, KMH = 0.44704, 1.0 / 3.6
# m/s that a thrown ball can have; a number outside is no speed.
MIN_THROW_SPEED, MAX_THROW_SPEED = 2.0, 55.0

# pitcher_session_height(in)_weight(lb)_number_kind_speed(tenths of mph), as in the OpenBiomechanics Project
_PITCH = re.compile(r"^\d{5,6}_\d{5,6}_\d{2,3}_\d{2,3}_\d{1,3}_[A-Za-z]{2}_(\d{3,4})$")
_WITH_UNIT = re.compile(r"(?<![\d.])(\d{1,3}(?:[.,p]\d{1,2})?)[ _-]?(mph|kmh|kph|km[_-]h|mps|m[_-]s)(?![a-z])", re.I)
_UNITS = {"mph": MPH, "kmh": KMH, "kph": KMH, "km_h": KMH, "mps": 1.0, "m_s": 1.0}


def parse_radar_speed(name: str) -> float | None:
    """Parse a measured speed from a file name.

    `000000_000000_74_195_002_FF_808` is a pitch of 80.8 mph; `throw_130kmh`, `throw-36.1mps`, `ff_81mph` contain a
    unit.

    Args:
        name: the file name without its ending.
    Returns:
        m/s; None where there is no clear speed, or two different ones.
    """
    pitch = _PITCH.match(name)
    if pitch:
        return _limit_to_throws(int(pitch[1]) / 10.0 * MPH)
    speeds = {round(float(re.sub("[,p]", ".", number.lower())) * _UNITS[unit.lower().replace("-", "_")], 6) for number,
              unit in _WITH_UNIT.findall(name)}
    return _limit_to_throws(speeds.pop()) if len(speeds) == 1 else None


def _limit_to_throws(speed: float) -> float | None:
    return speed if MIN_THROW_SPEED <= speed <= MAX_THROW_SPEED else None
