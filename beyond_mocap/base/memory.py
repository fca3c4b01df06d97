"""How much memory is free, how much a process has held, and an error in one line before a work that needs more."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from .errors import InputError

_GIGABYTE = 1e9
_PROCESS = Path("/proc/self")
_GROUPS = Path("/sys/fs/cgroup")
_GROUP_FILES = (  # folder of all control groups; the files that say what one allows and uses; what of it can be dropped
    ("", "memory.max", "memory.current", "inactive_file"),
    ("memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
)


def read_free_bytes() -> float | None:
    """Read how many bytes of memory a process can still take; None where the system does not say."""
    found = [free for free in (_read_available(), _read_groups(), _read_process_limit()) if free is not None]
    return min(found, default=None)


def _read_available() -> float | None:
    """Read the memory that is available without swapping, in bytes."""
    if (free := _read_kilobytes(Path("/proc/meminfo"), "MemAvailable")) is not None:
        return 1024.0 * free
    try:  # other systems tell the machine's memory at most
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, OSError, ValueError):
        return None


def _read_kilobytes(path: Path, name: str) -> float | None:
    """Read a row such as "VmHWM: 1024 kB" of a system's file; None where there is none."""
    try:
        rows = dict(line.split(":", 1) for line in path.read_text("utf-8").splitlines())
        return float(rows[name].split()[0])
    except (OSError, ValueError, KeyError):
        return None


def _read_groups() -> float | None:
    """Read what the limits of the process's control groups, such as a container's, leave, in bytes; None without one.
    """
    try:
        rows = [line.split(":", 2) for line in (_PROCESS / "cgroup").read_text("utf-8").splitlines()]
    except (OSError, ValueError):
        return None
    left = []
    for name, *files in _GROUP_FILES:
        for place in (place for _, names, place in rows if name in names.split(",")):
            folder = _GROUPS / name / place.lstrip("/")
            for group in (folder, *folder.parents):
                if group.is_relative_to(_GROUPS / name):
                    left.append(_read_group(group, *files))
    return min((free for free in left if free is not None), default=None)


def _read_group(folder: Path, allowed: str, used: str, dropped: str) -> float | None:
    """Read what the limit of a control group leaves, in bytes; None without a limit."""
    try:
        most, now = (float((folder / name).read_text("ascii")) for name in (allowed, used))
        rows = dict(line.split() for line in (folder / "memory.stat").read_text("ascii").splitlines())
        return most - now + float(rows[dropped])
    except (OSError, ValueError, KeyError):  # "max": no limit
        return None


def _read_process_limit() -> float | None:
    """Read what the limit of this process (`ulimit -v`) leaves, in bytes; None without one."""
    try:
        import resource  # not on Windows

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        pages = float((_PROCESS / "statm").read_text("ascii").split()[0])
    except (ImportError, OSError, ValueError):
        return None
    return None if limit == resource.RLIM_INFINITY else limit - pages * resource.getpagesize()


def read_peak_memory() -> float:
    """Read the most memory that this process has held so far, in MB; 0 where the system does not say (Windows)."""
    if (held := _read_kilobytes(_PROCESS / "status", "VmHWM")) is not None:
        return held / 1024.0
    try:
        import resource
    except ImportError:
        return 0.0
    # not on Linux, where a new process inherits what the one that started it has held
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1024.0)


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
        raise InputError(where, f"this needs about {_format_gigabytes(needed)} GB, {_format_gigabytes(free)} are free",
                         next_step=next_step)


def _format_gigabytes(count: float) -> str:
    """Format bytes as gigabytes, with one digit behind the point below ten."""
    value = count / _GIGABYTE
    return f"{value:.0f}" if value >= 9.95 else f"{value:.1f}"
