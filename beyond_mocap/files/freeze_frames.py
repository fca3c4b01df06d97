"""Single moments of StatsBomb 360: where the people in the picture were at an event, as a still with a moving ball.

A freeze frame has places and nothing before or after. The still lasts four seconds: all stand where they were, the
player of the event does what it says, and the ball rests until then and goes straight to where the event ends.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..annotation.event_labels import read_event_labels
from ..annotation.vocabulary import SIDES
from ..base.content import read_utf8
from ..base.errors import InputError, describe_damage, format_count
from ..motion.track import BALL_RADIUS
from .atomic import atomic_folder
from .file_names import build_file_names
from .json_values import parse_json
from .tables import format_csv
from .tracking.match_arrays import USUAL_PITCH

COLUMNS = ("time_s", "player", "x_m", "y_m", "z_m", "team", "position")
_FIELD = np.array([120.0, 80.0])  # StatsBomb's units, which stretch to the pitch; y grows to the right of the attack
_BESIDE, _MOST_OUTSIDE = 10.0, 0.05  # units beside the pitch, and the share of places that may be farther
_FARTHEST = 10.0 * _FIELD[0]  # units, of any place
_YARD = 0.9144  # metres, of heights
_RATE, _SECONDS, EVENT_TIME = 25.0, 4.0, 2.0
_STEP = 0.45  # metres from a standing player to the ball
_FASTEST = 38.0  # m/s of a kicked ball
_MOST_PEOPLE = 60
BALL = "ball"  # the player of a plain CSV that is the ball
TRACKING, LABELS = "moment.csv", "labels"
_KINDS = {"Pass": "pass", "Shot": "shot", "Clearance": "clearance", "Ball Receipt*": "receive", "Goal Keeper": "save",
          "Interception": "interception", "Duel": "tackle"}
"""StatsBomb's types -> kinds of `event_labels.KINDS`."""
_ENDED = ("pass", "shot", "carry", "goalkeeper")  # parts of an event with an end_location


@dataclass(frozen=True, eq=False)
class FreezeFrame:
    """The people in the picture at an event.

    Attributes:
        id: of the event.
        clock: "MM:SS" of the match.
        kind: of the event.
        player: who it is of.
        team: of that player.
        places: (P, 2) StatsBomb's units.
        roles: of each of P: "actor", "teammate" or "opponent", with " keeper" behind it where it is one.
        ball: (2,) StatsBomb's units.
        end: (2,) or (3,) of the ball; None: it rests.
        duration: s until then.
        labels: what the player does, () where the event does not say.
    """

    id: str
    clock: str
    kind: str
    player: str
    team: str
    places: np.ndarray
    roles: tuple[str, ...]
    ball: np.ndarray
    end: np.ndarray | None
    duration: float
    labels: tuple[str, ...]


def read_freeze_frames(frames: Path, events: Path) -> list[FreezeFrame]:
    """Read the freeze frames of a match's events.

    Args:
        frames: StatsBomb's 360 file.
        events: the events of the same match.
    Returns:
        The frames whose events have a place, in the events' order.
    Raises:
        InputError: if one is another file, or they are of two matches.
    """
    pictures, rows = _read_list(frames, "freeze_frame", "360 data"), _read_list(events, "type", "events")
    by_event = {str(picture.get("event_uuid")): picture for picture in pictures}
    found = [_read_frame(row, by_event[event], f"{frames.name} and {events.name}: event {event[:40]}") for row in rows
             if (event := str(row.get("id"))) in by_event and row.get("location") and by_event[event]["freeze_frame"]]
    _check_places(frames, [frame.places for frame in found])
    _check_places(events, [place[None, :2] for frame in found for place in (frame.ball, frame.end)
                           if place is not None])
    if not found:
        raise InputError(frames, f"no event of {events.name} has a freeze frame", "the events of the same match",
                         "choose the file with its number")
    return found


def _check_places(path: Path, places: list[np.ndarray]) -> None:
    """Check that places are in StatsBomb's units, from a corner of the pitch; some may be beside it."""
    rows = np.concatenate([np.zeros((0, 2)), *places])
    outside = np.any((rows < -_BESIDE) | (rows > _FIELD + _BESIDE), axis=1).sum()
    if outside > _MOST_OUTSIDE * len(rows) or np.any(np.abs(rows) > _FARTHEST):
        low, high = rows.min(axis=0), rows.max(axis=0)
        raise InputError(path, f"places from {low[0]:.4g} to {high[0]:.4g} along and {low[1]:.4g} to {high[1]:.4g} "
                         "across the pitch", f"StatsBomb's units, 0 to {_FIELD[0]:g} and 0 to {_FIELD[1]:g} from a "
                         "corner", "convert the places")


def _read_list(path: Path, key: str, kind: str) -> list[dict]:
    value = parse_json(read_utf8(path, "a JSON file of StatsBomb"), str(path), "docs/reference/match-input.md")
    if not isinstance(value, list) or not value or not all(isinstance(one, dict) and key in one for one in value):
        raise InputError(path, f"no list of objects with {key!r}", f"StatsBomb's {kind} as JSON",
                         "choose that file, or exchange 360 data and events")
    return value


def _read_frame(event: dict, picture: dict, where: str) -> FreezeFrame:
    """Build a frame; InputError for values that StatsBomb does not have."""
    try:
        return _build_frame(event, picture, where)
    except (LookupError, TypeError, AttributeError, ValueError, ArithmeticError) as error:
        raise InputError(where, describe_damage(error), "StatsBomb's 360 data and events",
                         "export them again") from None


def _build_frame(event: dict, picture: dict, where: str) -> FreezeFrame:
    people = picture["freeze_frame"]
    ended = next((event[part] for part in _ENDED if part in event and event[part].get("end_location")), None)
    duration = float(event.get("duration") or 0.0)
    places = _to_places([person["location"] for person in people], where)
    return FreezeFrame(
        id=str(event["id"]), clock=f"{int(event['minute']):02d}:{int(event['second']):02d}",
        kind=str(event["type"]["name"]), player=str((event.get("player") or {}).get("name") or ""),
        team=str((event.get("team") or {}).get("name") or ""), places=places,
        roles=tuple(_name_role(person) for person in people), ball=_to_places([event["location"][:2]], where)[0],
        end=None if ended is None else _to_places([ended["end_location"]], where, (2, 3))[0],
        duration=duration if math.isfinite(duration) else 0.0, labels=_find_labels(event),
    )  # fmt: skip


def _find_labels(event: dict) -> tuple[str, ...]:
    """Find what a standing player does at an event, by the table of events."""
    kind = _KINDS.get(str(event["type"]["name"]), "other")
    detail = next((event[part] for part in (kind, *_ENDED) if isinstance(event.get(part), dict)), {})
    body = str((detail.get("body_part") or {}).get("name") or "").lower()
    part = "head" if "head" in body else "hand" if "arm" in body or "hand" in body else "foot"
    height = str((detail.get("height") or {}).get("name") or "").lower()
    way = str((detail.get("type") or {}).get("name") or "").lower()
    values = {"side": next((side for side in SIDES if side in body), ""), "gait": "standing",
              "height": "high" if "high" in height else "low"}
    return read_event_labels().find_labels(kind, part, (way,), values)


def _to_places(rows: list, where: str, counts: Collection[int] = (2,)) -> np.ndarray:
    """Return locations of as many numbers as one of `counts`; InputError with the first other one."""
    limits = (np.inf, np.inf, _FARTHEST)  # what is far along or across is refused with its file
    for row in rows:
        if not isinstance(row, list) or len(row) not in counts or not all(map(_is_within, row, limits)):
            raise InputError(where, f"location {str(row)[:60]}", f"{' or '.join(map(str, counts))} numbers",
                             "export 360 data and events again")
    return np.array(rows, dtype=float).reshape(len(rows), -1)


def _is_within(value: object, limit: float) -> bool:
    """Tell whether a value is a number nearer to 0 than a limit."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < limit


def _name_role(person: dict) -> str:
    side = "actor" if person.get("actor") else "teammate" if person.get("teammate") else "opponent"
    return f"{side} keeper" if person.get("keeper") else side


def find_freeze_frame(frames: Sequence[FreezeFrame], wanted: str,
                      path: Path) -> tuple[FreezeFrame, list[FreezeFrame]]:
    """Find a frame by its event's id or its time.

    Args:
        frames: all frames.
        wanted: an event's id, or the beginning of one that no other has, or "MM:SS", also "M:SS".
        path: their file, for errors.
    Returns:
        The frame, of several in one second the first whose player does something; and those others.
    Raises:
        InputError: if there is none, or several ids begin so.
    """
    clock = wanted.zfill(len("MM:SS"))
    at_time = sorted((frame for frame in frames if frame.clock == clock), key=lambda frame: not frame.labels)
    found = at_time[:1] or [frame for frame in frames if wanted and frame.id.startswith(wanted)]
    if len(found) != 1:
        what = f"{len(found)} events whose ids begin with" if found else "no freeze frame of event"
        raise InputError(path, f"{what} {wanted!r}", "an event's id or time MM:SS", "leave --event out to list them")
    return found[0], at_time[1:]


def write_still(folder: Path, frame: FreezeFrame, size: tuple[float, float] | None = None) -> int:
    """Write a frame into a new folder: `moment.csv`, a plain CSV of tracking, and `labels` with what the player does.

    The team of the event's player attacks along +x.

    Args:
        folder: new or empty.
        frame: the frame.
        size: length and width of the pitch, m; None: 105 x 68.
    Returns:
        How many people it has.
    Raises:
        InputError: if it has too many, or the folder is not empty or cannot be written.
    """
    if len(frame.roles) > _MOST_PEOPLE:
        raise InputError(f"event {frame.id}", format_count(len(frame.roles), "person", "people"),
                         f"at most {_MOST_PEOPLE}", "choose another event")
    pitch = np.array(size or USUAL_PITCH)
    people, places = _name_people(frame), _to_metres(frame.places, pitch)
    times = np.arange(int(_RATE * _SECONDS) + 1) / _RATE
    rows: list[tuple[str, ...]] = [(f"{time:.2f}", name, f"{x:.3f}", f"{y:.3f}", "", ground, position)
            for time in times for (name, ground, position), (x, y) in zip(people, places)]
    rows += [(f"{time:.2f}", BALL, *(f"{value:.3f}" for value in place), "", "")
             for time, place in zip(times, _move_ball(frame, pitch, times))]
    names = build_file_names(name for name, _, _ in people)
    with atomic_folder(folder) as inside:
        (inside / LABELS).mkdir()
        (inside / TRACKING).write_text(format_csv(COLUMNS, rows), "utf-8")
        for (name, _, _), role in zip(people, frame.roles):
            if role.startswith("actor") and frame.labels:
                text = f"{EVENT_TIME:g} {' '.join(frame.labels)}\n"
                (inside / LABELS / f"{names[name]}.txt").write_text(text, "utf-8")
    return len(people)


def _name_people(frame: FreezeFrame) -> list[tuple[str, str, str]]:
    """Return name, team and position of each person; the first actor has the player's name."""
    counts, people, known = {"home": 0, "away": 0}, [], {"", BALL}
    for role in frame.roles:
        ground = "away" if role.startswith("opponent") else "home"
        counts[ground] += 1
        is_player = role.startswith("actor") and frame.player.lower() not in known
        name = frame.player if is_player else f"{ground} {counts[ground]}"
        known.add(name.lower())
        people.append((name, ground, "goalkeeper" if role.endswith("keeper") else ""))
    return people


def _to_metres(places: np.ndarray, pitch: np.ndarray) -> np.ndarray:
    """Turn places (..., 2) in StatsBomb's units into metres from the pitch's centre, y to the left."""
    return (places / _FIELD - 0.5) * pitch * (1.0, -1.0)


def _move_ball(frame: FreezeFrame, pitch: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the ball's places (T, 3) m: at rest until the event, then straight to its end.

    It rests a step before the player of the event, where that player is in the picture: the place that StatsBomb notes
    for the event is a metre or two beside the one that it sees.
    """
    start = np.array([*_to_metres(frame.ball, pitch), BALL_RADIUS])
    actor = next((place for place, role in zip(frame.places, frame.roles) if role.startswith("actor")), None)
    if frame.end is None:
        return np.tile(start, (len(times), 1))
    height = max(frame.end[2] * _YARD, BALL_RADIUS) if len(frame.end) > 2 else BALL_RADIUS
    end = np.array([*_to_metres(frame.end[:2], pitch), height])
    if actor is not None:
        foot = _to_metres(actor, pitch)
        start[:2] = foot + _STEP * (end[:2] - foot) / max(float(np.linalg.norm(end[:2] - foot)), _STEP)
    seconds = max(frame.duration, float(np.linalg.norm(end - start)) / _FASTEST, 1.0 / _RATE)
    share = np.clip((times - EVENT_TIME) / seconds, 0.0, 1.0)
    return start + share[:, None] * (end - start)
