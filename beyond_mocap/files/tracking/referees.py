"""Read what kloppy ignores in tracking data: referees, and the colours of shirts."""

from __future__ import annotations

import json
import re

import numpy as np

from ...motion.track.match_data import REFEREE
from .feed import Feed, Samples

_TRACAB_CODE = 3
_TRACAB = re.compile(rb"[;:]3,(-?\d+),(-?\d+),(-?\d+\.?\d*),(-?\d+\.?\d*),")
_COLOUR = re.compile(r"#?([0-9a-fA-F]{6})")
_JSON_COLOUR = r'"{side}_?[tT]eam_?[kK]it"\s*:\s*\{{[^{{}}]*?"(?:primaryColor|jersey_color)"\s*:\s*"([^"]+)"'
_XML_TEAM = re.compile(r"<Team\b[^>]*>")
_XML_SHIRT = re.compile(r'PlayerShirtMainColor="([^"]+)"')
_LARGEST = 16 * 1024 * 1024  # bytes of metadata at most


def referee_samples(feed: Feed, frames: np.ndarray) -> tuple[list[str], np.ndarray, list[str]]:
    """Read the referees' samples of a feed.

    Args:
        feed: the files.
        frames: (N,) the numbers of kloppy's frames.
    Returns:
        R ids; (R, N, 2) in the provider's coordinates, NaN where unknown; and a message if unreadable samples end them.
    """
    if feed.provider.read_referees is None:
        return [], np.empty((0, len(frames), 2)), []
    row = {int(frame): index for index, frame in enumerate(frames)}
    found: dict[str, np.ndarray] = {}
    lines, frame = [], "the first"
    try:
        for frame, who, x, y in feed.provider.read_referees(feed):
            if frame in row:
                found.setdefault(who, np.full((len(frames), 2), np.nan))[row[frame]] = x, y
    except (ValueError, TypeError, LookupError, AttributeError, SyntaxError) as error:  # SyntaxError: from XML
        lines = [f"referees are read up to frame {frame} only ({type(error).__name__}: {str(error)[:60]})"]
    names = sorted(found)
    return names, np.stack([found[name] for name in names]) if names else np.empty((0, len(frames), 2)), lines


def described_referee(id_: str) -> tuple[str, str, str, str, str]:
    """Describe a referee like `match_arrays.describe_player`.

    Args:
        id_: the id.
    Returns:
        Id, team, name, number and position.
    """
    return id_, REFEREE, id_.replace("_", " "), "-1", ""


def read_tracab_referees(feed: Feed) -> Samples:
    """Iterate over the referees' samples in TRACAB's two formats, lines and JSON.

    Args:
        feed: the files.
    """
    return _tracab_json(feed) if feed.path.suffix.lower() == ".json" else _tracab_lines(feed)


def _tracab_lines(feed: Feed) -> Samples:
    with open(feed.path, "rb") as file:
        for line in file:
            if b";3," in line or b":3," in line:
                frame = line.partition(b":")[0].strip()
                for who in _TRACAB.findall(line) if frame.isdigit() else ():
                    yield int(frame), f"referee_{int(who[1])}", float(who[2]), float(who[3])


def _tracab_json(feed: Feed) -> Samples:
    for frame in json.loads(feed.path.read_bytes()).get("FrameData", ()):
        for who in frame["PlayerPositions"]:
            if who["Team"] == _TRACAB_CODE:
                yield int(frame["FrameCount"]), f"referee_{who['JerseyNumber']}", float(who["X"]), float(who["Y"])


def read_sportec_referees(feed: Feed) -> Samples:
    """Iterate over the referees' samples in Sportec's positions.

    Args:
        feed: the files.
    """
    from xml.etree.ElementTree import iterparse

    who = ""
    for event, element in iterparse(feed.path, events=("start", "end")):
        if event == "start" and element.tag == "FrameSet":
            who = element.get("PersonId", "") if element.get("TeamId", "").lower() == "referee" else ""
        elif event == "end" and element.tag == "Frame":
            if who:
                yield int(element.get("N")), who, float(element.get("X")), float(element.get("Y"))
            element.clear()
        elif event == "end" and element.tag == "FrameSet":
            element.clear()


def read_signality_referees(feed: Feed) -> Samples:
    """Iterate over the referees' samples in Signality's halves, whose frames are numbered continuously.

    Args:
        feed: the files.
    """
    before = 0
    for path in feed.tracking:
        frames = json.loads(path.read_bytes())
        for frame in frames:
            for who in frame.get("referees") or ():
                x, y = who["position"][:2]
                yield frame["idx"] + before, f"referee_{who.get('role', who.get('track_id'))}", float(x), float(y)
        before = frames[-1]["idx"] + 1 if frames else before


def read_team_colours(feed: Feed) -> dict[str, str]:
    """Read the teams' shirt colours from the metadata.

    Args:
        feed: the files.
    Returns:
        "home" and "away" -> "#RRGGBB", "" if unknown.
    """
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
    """Parse a colour to "#RRGGBB" in capitals, "" if it is none."""
    match = _COLOUR.fullmatch(said.strip())
    return f"#{match[1].upper()}" if match else ""
