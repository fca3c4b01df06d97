"""Data that is linked from another file: it can be looked at, but what is written to it is lost with the next load."""

from __future__ import annotations

import bpy

from ...beyond_mocap.base.errors import InputError


def refuse(*things: bpy.types.ID | None) -> None:
    """InputError where one of these belongs to another file and is no library override."""
    for thing in things:
        if thing is not None and thing.library is not None:
            found = f"linked from {thing.library.filepath}"
            step = "use Object > Library Override > Make, or Object > Relations > Make Local"
            raise InputError(thing.name, found, "one of this file", step)
