"""Read what kloppy ignores in tracking data: referees, and the colours of shirts."""

from __future__ import annotations

import json
import re

import numpy as np

from .feed import Feed, Samples

_TRACAB_CODE = 3
_TRACAB = re.compile(rb"[;:]3,(-?\d+),(-?\d+),(-?\d+\.?\d*),(-?\d+\.?\d*),")
_COLOUR = re.compile(r"#?([0-9a-fA-F]{6})")
_JSON_COLOUR = r'"{side}_?[tT]eam_?[kK]it"\s*:\s*\{{[^{{}}]*?"(?:primaryColor|jersey_color)"\s*:\s*"([^"]+)"'
_XML_TEAM = re.compile(r"<Team\b[^>]*>")
_XML_SHIRT = re.compile(r'PlayerShirtMainColor="([^"]+)"')
_MAX_BYTES = 16 * 1024 * 1024  # bytes of metadata at most


def read_referee_samples(feed: Feed, frames: np.ndarray) -> tuple[list[str], np.ndarray, list[str]]:
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
    samples: dict[str, np.ndarray] = {}
    lines, frame = [], "the first"
    try:
        for frame, referee, x, y in feed.provider.read_referees(feed):
            if frame in row:
                samples.setdefault(referee, np.full((len(frames), 2), np.nan))[row[frame]] = x, y
    except (ValueError, TypeError, LookupError, AttributeError, SyntaxError):  # SyntaxError: from XML
        lines = [f"referees are read up to frame {frame} only: the file is damaged there"]
    names = sorted(samples)
    return names, np.stack([samples[name] for name in names]) if names else np.empty((0, len(frames), 2)), lines


def describe_referee(id_: str) -> tuple[str, str, str, str, str]:
    """Describe a referee like `match_arrays.describe_player`.

    Args:
        id_: the id.
    Returns:
        Id, team, name, number and position.
    """
    from ...motion.track.match_data import REFEREE

    return id_, REFEREE, id_.replace("_", " "), "-1", ""


def read_tracab_referees(feed: Feed) -> Samples:
    """Iterate over the referees' samples in TRACAB's two formats, lines and JSON.

    Args:
        feed: the files.
    """
    return _iter_tracab_json(feed) if feed.path.suffix.lower() == ".json" else _iter_tracab_lines(feed)


def _iter_tracab_lines(feed: Feed) -> Samples:
    with open(feed.path, "rb") as file:
        for line in file:
            if b";3," in line or b":3," in line:
                frame = line.partition(b":")[0].strip()
                for cells in _TRACAB.findall(line) if frame.isdigit() else ():
                    yield int(frame), f"referee_{int(cells[1])}", float(cells[2]), float(cells[3])


def _iter_tracab_json(feed: Feed) -> Samples:
    for frame in json.loads(feed.path.read_bytes()).get("FrameData", ()):
        for person in frame["PlayerPositions"]:
            if person["Team"] == _TRACAB_CODE:
                yield int(frame["FrameCount"]), f"referee_{person['JerseyNumber']}", float(person["X"]), float(
                    person["Y"])


def read_sportec_referees(feed: Feed) -> Samples:
    """Iterate over the referees' samples in Sportec's positions.

    Args:
        feed: the files.
    """
    from xml.etree.ElementTree import iterparse

    referee = ""
    for event, element in iterparse(feed.path, events=("start", "end")):
        if event == "start" and element.tag == "FrameSet":
            referee = element.get("PersonId", "") if element.get("TeamId", "").lower() == "referee" else ""
        elif event == "end" and element.tag == "Frame":
            if referee:
                yield int(element.get("N")), referee, float(element.get("X")), float(element.get("Y"))
            element.clear()
        elif event == "end" and element.tag == "FrameSet":
            element.clear()


def read_signality_referees(feed: Feed) -> Samples:
    """Iterate over the referees' samples in Signality's halves, whose frames are numbered continuously.

    Args:
        feed: the files.
    """
    first_number = 0
    for path in feed.tracking:
        frames = json.loads(path.read_bytes())
        for frame in frames:
            for referee in frame.get("referees") or ():
                x, y = referee["position"][:2]
                yield frame["idx"] + first_number, f"referee_{referee.get('role', referee.get('track_id'))}", float(
                    x), float(y)
        first_number = frames[-1]["idx"] + 1 if frames else first_number


def read_team_colours(feed: Feed) -> dict[str, str]:
    """Read the teams' shirt colours from the metadata.

    Args:
        feed: the files.
    Returns:
        "home" and "away" -> "#RRGGBB", "" if unknown.
    """
    colours = {"home": "", "away": ""}
    if not feed.meta or feed.meta[0].stat().st_size > _MAX_BYTES:
        return colours
    text = feed.meta[0].read_text(encoding="utf-8", errors="replace")
    for side in colours:
        match = re.search(_JSON_COLOUR.format(side=side), text)
        colours[side] = _parse_colour(match[1]) if match else ""
    for tag in _XML_TEAM.findall(text) if text.lstrip().startswith("<") else ():
        shirt = _XML_SHIRT.search(tag)
        side = "home" if 'Role="home"' in tag else "away" if re.search(r'Role="(guest|away)"', tag) else None
        if shirt and side:
            colours[side] = _parse_colour(shirt[1])
    return colours


def _parse_colour(text: str) -> str:
    """Parse a colour to "#RRGGBB" in capitals, "" if it is none."""
    match = _COLOUR.fullmatch(text.strip())
    return f"#{match[1].upper()}" if match else ""
