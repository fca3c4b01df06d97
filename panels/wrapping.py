"""Text over several lines, or shortened where it matters least, because Blender cuts labels."""

from __future__ import annotations

import re
import textwrap

import bpy

LETTER_WIDTH = 5.7  # mean width of an interface letter in pixels, at a scale of 1
MARGIN = 70  # pixels of a sidebar without text: tabs, the box and its icon
BARE_MARGIN = 45  # the same where there is neither box nor icon


def wrap_text(text: str) -> list[str]:
    """Wrap text to the sidebar's width."""
    return textwrap.wrap(text, count_letters())


def shorten_progress(text: str, margin: int = MARGIN) -> str:
    """Shorten what is being done to the words for which there is room, never its share and the time that is left."""
    step, share = re.fullmatch(r"(.*?)( \d+ %.*)?", text, re.DOTALL).groups("")
    room = count_letters(margin)
    return text if len(text) <= room else textwrap.shorten(step, max(room - len(share), 1), placeholder="…") + share


def count_letters(margin: int = MARGIN) -> int:
    """Count the letters for which a line has room in the sidebar, beside pixels without text."""
    width = bpy.context.region.width / bpy.context.preferences.system.ui_scale
    return max(16, int((width - margin) / LETTER_WIDTH))
