"""Blender's names are unique in a file: what several scenes have each gets a number behind its name."""

from __future__ import annotations

import re
from collections.abc import Iterable

import bpy


def find_named(things: Iterable[bpy.types.ID], name: str):
    """Find what has a name, with or without the number that Blender adds; None if nothing has it.

    Args:
        things: objects of one collection, or collections of one scene.
        name: without a number.
    Returns:
        The first one of them.
    """
    wanted = re.compile(re.escape(name) + r"(\.\d{3,})?")
    return next((thing for thing in things if wanted.fullmatch(thing.name)), None)
