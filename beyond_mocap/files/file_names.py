"""Names that files may have on every system."""

from __future__ import annotations

import re

_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\.|$)", re.IGNORECASE)


def avoid_reserved_name(name: str) -> str:
    """Put an underscore before a name that Windows keeps for devices, such as CON; other names stay.

    Args:
        name: of a file, with or without its ending.
    Returns:
        A name that every system can have.
    """
    return f"_{name}" if _RESERVED.match(name) else name
