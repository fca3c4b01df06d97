"""Referees in tracking files; kloppy leaves them out, so they are read here, of the providers that have them."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import numpy as np

from .match_data import REFEREE
from .providers import Feed

_TRACAB_CODE = 3
_TRACAB = re.compile(rb"[;:]3,(-?\d+),(-?\d+),(-?\d+\.?\d*),(-?\d+\.?\d*),")
_SAMPLE = tuple[int, str, float, float]  # frame, who, x and y in the provider's coordinates


def referee_samples(feed: Feed, frames: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Ids of the R referees in a feed, and where they are (R, N, 2) in the provider's coordinates, NaN where they are
    not known. frames: (N,) the numbers of kloppy's frames."""
    row = {int(frame): index for index, frame in enumerate(frames)}
    found: dict[str, np.ndarray] = {}
    for frame, who, x, y in _samples(feed):
        if frame in row:
            found.setdefault(who, np.full((len(frames), 2), np.nan))[row[frame]] = x, y
    names = sorted(found)
    return names, np.stack([found[name] for name in names]) if names else np.empty((0, len(frames), 2))


def described_referee(id_: str) -> tuple[str, str, str, str, str]:
    """Id, team, name, number and position, as `match_arrays.described` has them."""
    return id_, REFEREE, id_.replace("_", " "), "-1", ""


def _samples(feed: Feed) -> Iterator[_SAMPLE]:
    if feed.provider == "tracab" and feed.path.suffix.lower() != ".json":
        yield from _tracab_lines(feed)
    elif feed.provider == "tracab":
        yield from _tracab_json(feed)
    elif feed.provider == "sportec":
        yield from _sportec(feed)
    elif feed.provider == "signality":
        yield from _signality(feed)


def _tracab_lines(feed: Feed) -> Iterator[_SAMPLE]:
    with open(feed.path, "rb") as file:
        for line in file:
            if b";3," in line or b":3," in line:
                frame = line.partition(b":")[0].strip()
                for who in _TRACAB.findall(line) if frame.isdigit() else ():
                    yield int(frame), f"referee_{int(who[1])}", float(who[2]), float(who[3])


def _tracab_json(feed: Feed) -> Iterator[_SAMPLE]:
    for frame in json.loads(feed.path.read_bytes()).get("FrameData", ()):
        for who in frame["PlayerPositions"]:
            if who["Team"] == _TRACAB_CODE:
                yield int(frame["FrameCount"]), f"referee_{who['JerseyNumber']}", float(who["X"]), float(who["Y"])


def _sportec(feed: Feed) -> Iterator[_SAMPLE]:
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


def _signality(feed: Feed) -> Iterator[_SAMPLE]:
    before = 0
    for path in feed.tracking:
        frames = json.loads(path.read_bytes())
        for frame in frames:
            for who in frame.get("referees") or ():
                x, y = who["position"][:2]
                yield frame["idx"] + before, f"referee_{who.get('role', who.get('track_id'))}", float(x), float(y)
        before = frames[-1]["idx"] + 1 if frames else before
