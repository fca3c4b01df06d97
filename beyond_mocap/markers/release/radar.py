"""The ball's speed that a recording's name tells, as a speed gun measured it."""

from __future__ import annotations

import re

MPH, KMH = 0.44704, 1.0 / 3.6
SLOWEST, FASTEST = 2.0, 55.0
"""m/s: what a ball out of a hand can have; a number outside is something else."""

# pitcher_session_height(in)_weight(lb)_number_kind_speed(tenths of mph), as in the OpenBiomechanics Project
_PITCH = re.compile(r"^\d{5,6}_\d{5,6}_\d{2,3}_\d{2,3}_\d{1,3}_[A-Za-z]{2}_(\d{3,4})$")
_WITH_UNIT = re.compile(r"(?<![\d.])(\d{1,3}(?:[.,p]\d{1,2})?)[ _-]?(mph|kmh|kph|km[_-]h|mps|m[_-]s)(?![a-z])", re.I)
_UNITS = {"mph": MPH, "kmh": KMH, "kph": KMH, "km_h": KMH, "mps": 1.0, "m_s": 1.0}


def radar_speed(name: str) -> float | None:
    """m/s out of a file's name without its ending, or None where it tells no speed for certain.

    `000000_000000_74_195_002_FF_808` is a pitch of 80.8 mph; `throw_130kmh`, `throw-36.1mps`, `ff_81mph` say it with a
    unit. Two different speeds in one name are none.
    """
    pitch = _PITCH.match(name)
    if pitch:
        return _possible(int(pitch[1]) / 10.0 * MPH)
    told = {
        round(float(re.sub("[,p]", ".", number.lower())) * _UNITS[unit.lower().replace("-", "_")], 6)
        for number, unit in _WITH_UNIT.findall(name)
    }
    return _possible(told.pop()) if len(told) == 1 else None


def _possible(speed: float) -> float | None:
    return speed if SLOWEST <= speed <= FASTEST else None
