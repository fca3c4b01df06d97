"""Referees in tracking files; kloppy leaves them out, so they are read here, for the providers that have them."""

from __future__ import annotations

import json
import re

import numpy as np

from ...motion.track.match_data import REFEREE
from .feed import Feed, Samples

_TRACAB_CODE = 3
_TRACAB = re.compile(rb"[;:]3,(-?\d+),(-?\d+),(-?\d+\.?\d*),(-?\d+\.?\d*),")


def referee_samples(feed: Feed, frames: np.ndarray) -> tuple[list[str], np.ndarray, list[str]]:
    """Ids of the R referees in a feed, where they are (R, N, 2) in the provider's coordinates, NaN where they are not
    known, and lines: samples that cannot be read end them. frames: (N,) the numbers of kloppy's frames."""
    if feed.provider.read_referees is None:
        return [], np.empty((0, len(frames), 2)), []
    row = {int(frame): index for index, frame in enumerate(frames)}
    found: dict[str, np.ndarray] = {}
    lines, frame = [], "the first"
    try:
        for frame, who, x, y in feed.provider.read_referees(feed):
            if frame in row:
                found.setdefault(who, np.full((len(frames), 2), np.nan))[row[frame]] = x, y
    except (ValueError, TypeError, LookupError, AttributeError, SyntaxError) as error:  # SyntaxError: of XML
        lines = [f"referees are read up to frame {frame} only ({type(error).__name__}: {str(error)[:60]})"]
    names = sorted(found)
    return names, np.stack([found[name] for name in names]) if names else np.empty((0, len(frames), 2)), lines


def described_referee(id_: str) -> tuple[str, str, str, str, str]:
    """Id, team, name, number and position, as `match_arrays.described` has them."""
    return id_, REFEREE, id_.replace("_", " "), "-1", ""


def read_tracab_referees(feed: Feed) -> Samples:
    """Those of TRACAB's two forms, lines and JSON."""
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
    """Those of Sportec's positions."""
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
    """Those of Signality's halves, whose frames are counted through."""
    before = 0
    for path in feed.tracking:
        frames = json.loads(path.read_bytes())
        for frame in frames:
            for who in frame.get("referees") or ():
                x, y = who["position"][:2]
                yield frame["idx"] + before, f"referee_{who.get('role', who.get('track_id'))}", float(x), float(y)
        before = frames[-1]["idx"] + 1 if frames else before
