"""Settings of a path edit, checked."""

from __future__ import annotations

from dataclasses import dataclass

from ..base.errors import InputError
from ..base.settings import collect_defaults, find_setting
from . import path_frame

_DEFAULTS = collect_defaults("path_editing")
ENDS = find_setting("path_editing", "end").choice_names
_SPEED = find_setting("path_editing", "speed")


@dataclass(frozen=True, kw_only=True)
class PathEditSettings:
    """Settings of a path edit; the settings table describes each of them.

    Attributes:
        detours: (arc, width, offset to the left) of each detour, metres.
    Raises:
        InputError: if a value is unknown or outside its limits.
    """

    fit: str = _DEFAULTS["fit"]
    degree: int = _DEFAULTS["degree"]
    by_arc_length: bool = _DEFAULTS["by_arc_length"]
    speed: float = _DEFAULTS["speed"]
    end: str = _DEFAULTS["end"]
    cycle: bool = _DEFAULTS["cycle"]
    frame: str = _DEFAULTS["frame"]
    plant: bool = _DEFAULTS["plant"]
    lean: bool = _DEFAULTS["lean"]
    bends: bool = _DEFAULTS["bends"]
    slopes: bool = _DEFAULTS["slopes"]
    climbs: bool = _DEFAULTS["climbs"]
    delay: float = _DEFAULTS["delay"]
    detours: tuple[tuple[float, float, float], ...] = ()

    def __post_init__(self):
        path_frame.check_frame(self.frame)
        if self.end not in ENDS:
            raise InputError("end of path", str(self.end), " or ".join(ENDS))
        if self.fit not in path_frame.KINDS:
            raise InputError("path fit", str(self.fit), " or ".join(path_frame.KINDS))
        if not _SPEED.least <= self.speed <= _SPEED.most:
            raise InputError("speed", f"{self.speed:g}", f"a factor from {_SPEED.least:g} to {_SPEED.most:g}")
        if not 0.0 <= self.delay < 86400.0:
            raise InputError("delay", f"{self.delay:g} s", "0 s or more, less than a day")
