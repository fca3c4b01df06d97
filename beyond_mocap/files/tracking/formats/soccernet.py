"""Game state of SoccerNet: the players that detection and calibration found in a broadcast picture, on the pitch.

Its pitch has x to the right and y towards the lower touch line, as a picture has it (SoccerNet camera calibration).
"""

from __future__ import annotations

from ....base.errors import InputError
from ..feed import Feed
from ..match_arrays import USUAL_PITCH
from .cdf import read_json
from .samples import MatchSamples, SampleCollector

_RATE = 25.0  # of its pictures, where a file does not say
_GROUNDS = {"left": "home", "right": "away"}


def read_soccernet(feed: Feed) -> MatchSamples:
    """Read labels or predictions of a game state. The team on the left is the home team.

    Args:
        feed: the file.
    Returns:
        The match.
    Raises:
        InputError: for a file of another form.
    """
    state, found = read_json(feed.path), SampleCollector(feed.path)
    items = state.get("annotations") or state.get("predictions") or ()
    frames = {str(image["image_id"]): number for number, image in enumerate(state.get("images") or ())}
    if not frames:
        frames = {name: number for number, name in enumerate(sorted({str(item["image_id"]) for item in items}))}
    fps = float((state.get("info") or {}).get("frame_rate") or _RATE)
    if not 1.0 <= fps <= 200.0:
        raise InputError(feed.path, f"{fps:g} frames per second", "1 to 200", "correct info.frame_rate")
    for item in items:
        box = item.get("bbox_pitch") or {}
        x, y = box.get("x_bottom_middle"), box.get("y_bottom_middle")
        if x is not None and y is not None:
            _add_item(found, item, (1, round(frames[str(item["image_id"])] / fps, 4)), x, -y)
    found.lines.append("the team on the left is taken as the home team; places come from the picture's boxes")
    return found.build(USUAL_PITCH, fps=fps)


def _add_item(found: SampleCollector, item: dict, moment: tuple[int, float], x: float, y: float) -> None:
    """Add a person, or the ball."""
    about = item.get("attributes") or {}
    role = str(about.get("role") or "")
    if role == "ball":
        found.add_ball(moment, x, y)
    elif role in ("player", "goalkeeper", "referee"):
        key, jersey = str(item["track_id"]), str(about.get("jersey") or "")
        ground = "" if role == "referee" else _GROUNDS.get(str(about.get("team")), "")
        found.add_person(key, ground, "", int(jersey) if jersey.isdigit() and len(jersey) < 4 else None,
                         role if role == "goalkeeper" else "")
        found.add_sample(moment, key, x, y)
