"""How much memory is free, and an error in one line before a work that needs more."""

from __future__ import annotations

import os
from pathlib import Path

from .errors import InputError

_GIGABYTE = 1e9
_LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current")  # of a container: bytes allowed, bytes used


def read_free_bytes() -> float | None:
    """Read how many bytes of memory a process can still take; None where the system does not say."""
    found = [free for free in (_read_available(), _read_container()) if free is not None]
    return min(found, default=None)


def _read_available() -> float | None:
    """Read the memory that is available without swapping, in bytes."""
    try:
        rows = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text("ascii").splitlines())
        return 1024.0 * float(rows["MemAvailable"].split()[0])
    except (OSError, ValueError, KeyError):
        pass
    try:  # other systems tell the machine's memory at most
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, OSError, ValueError):
        return None


def _read_container() -> float | None:
    """Read what the limit of a container leaves, in bytes; None without a limit."""
    try:
        allowed, used = (float(Path(file).read_text("ascii")) for file in _LIMITS)
    except (OSError, ValueError):  # "max": no limit
        return None
    return allowed - used


def check_memory(where: object, needed: float, next_step: str) -> None:
    """Raise an error if less memory is free than a work needs, before it begins.

    Args:
        where: what the work is about: a file, a folder.
        needed: bytes, about.
        next_step: what needs less.
    Raises:
        InputError: if it is not free.
    """
    free = read_free_bytes()
    if free is not None and needed > free:
        raise InputError(where, f"this needs about {_format_gigabytes(needed)} GB, {_format_gigabytes(free)} are free: "
                                f"{next_step}")


def _format_gigabytes(count: float) -> str:
    """Format bytes as gigabytes, with one digit behind the point below ten."""
    value = count / _GIGABYTE
    return f"{value:.0f}" if value >= 9.95 else f"{value:.1f}"
