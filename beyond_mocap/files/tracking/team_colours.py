"""The colours of the teams' shirts, where a provider's metadata has them; kloppy leaves them out."""

from __future__ import annotations

import re

from .feed import Feed

_COLOUR = re.compile(r"#?([0-9a-fA-F]{6})")
_JSON_COLOUR = r'"{side}_?[tT]eam_?[kK]it"\s*:\s*\{{[^{{}}]*?"(?:primaryColor|jersey_color)"\s*:\s*"([^"]+)"'
_XML_TEAM = re.compile(r"<Team\b[^>]*>")
_XML_SHIRT = re.compile(r'PlayerShirtMainColor="([^"]+)"')
_LARGEST = 16 * 1024 * 1024  # bytes of metadata


def team_colours(feed: Feed) -> dict[str, str]:
    """ "home" and "away" -> "#RRGGBB", "" where the metadata has none."""
    found = {"home": "", "away": ""}
    if not feed.meta or feed.meta[0].stat().st_size > _LARGEST:
        return found
    said = feed.meta[0].read_text(encoding="utf-8", errors="replace")
    for side in found:
        match = re.search(_JSON_COLOUR.format(side=side), said)
        found[side] = _colour(match[1]) if match else ""
    for tag in _XML_TEAM.findall(said) if said.lstrip().startswith("<") else ():
        shirt = _XML_SHIRT.search(tag)
        side = "home" if 'Role="home"' in tag else "away" if re.search(r'Role="(guest|away)"', tag) else None
        if shirt and side:
            found[side] = _colour(shirt[1])
    return found


def _colour(said: str) -> str:
    """ "#RRGGBB" in capitals, "" where it is no colour."""
    match = _COLOUR.fullmatch(said.strip())
    return f"#{match[1].upper()}" if match else ""
