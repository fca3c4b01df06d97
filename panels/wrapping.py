"""Text over several lines, because Blender cuts labels."""

from __future__ import annotations

import textwrap

import bpy

LETTER_WIDTH = 5.7  # mean width of an interface letter in pixels, at a scale of 1
MARGIN = 70  # pixels of a sidebar without text: tabs, the box and its icon


def wrap_text(text: str) -> list[str]:
    """Wrap text to the sidebar's width."""
    width = bpy.context.region.width / bpy.context.preferences.system.ui_scale
    return textwrap.wrap(text, max(16, int((width - MARGIN) / LETTER_WIDTH)))
