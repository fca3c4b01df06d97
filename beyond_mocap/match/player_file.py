"""The file of a player of a match, ID.take.npz: written and read.

It (docs/reference/match-folder.md) is a zip of plain arrays of whole numbers and some fractions, with one JSON
text for everything else. Positions are in millimetres and times in microseconds, as second differences, which compress
well.
"""

from __future__ import annotations

import io
import json
import os
from dataclasses import asdict, fields

import numpy as np

from ..annotation import KeyMoment, Span, Timeline
from ..base.content import read_bytes
from ..base.errors import InputError
from ..files.atomic import atomic_write
from ..files.json_values import (
    check_bool,
    check_list,
    check_names,
    check_number,
    check_numbers,
    check_text,
    check_texts,
    check_whole_number,
    describe_value,
)
from ..files.plain_npz import HEADER, name_file, read_plain_arrays, take_header
from ..motion.track import Track
from ..synthesis.heading_path import HeadingPath
from ..synthesis.heading_request import HeadingKey
from ..synthesis.known_body import KnownBody
from ..synthesis.pin import Pin
from ..synthesis.plan import METHODS, Plan, PlayerTouch, SolvedTrajectory
from .crowd.correction import Correction
from .pieces.named_edit import NamedEdit, NamedKey
from .player_edit import PlayerEdit, Stretch, build_ball_times

VERSION = 1
FORMAT = "Beyond Mocap player of a match"
MAX_FILE_BYTES = 200_000_000
"""Bytes: a larger file is rejected."""
MAX_ARRAY_BYTES = 1_000_000_000
"""Bytes of all arrays together: a file with more is rejected."""
_KIND = "a player of a match (ID.take.npz)"
_PAGE = "docs/reference/match-folder.md"
_TYPES = tuple(np.dtype(name) for name in ("<f8", "<i8", "<i4", "<i2", "|i1", "|u1"))
_MAX_STRETCH = 24 * 3600.0
"""s: a longer stretch is rejected."""
_MAX_FRAMES, _MAX_RATE = 1e7, 100.0
_MIN_WINDOW = 1.0  # s
_DEFAULTS = {
    field.name: field.default for field in fields(Plan)
    if field.name not in ("track", "timeline", "pins", "heading_keys", "contact_edits", "solved", "heading_path",
                          "bodies")
}  # fmt: skip
_RUN_TYPES = {"clip": "<i2", "first": "<f8", "rate": "<f8", "length": "<i4", "cut": "|u1"}
_UNKNOWN = -(2**31)


def write_player(path: str | os.PathLike, edit: PlayerEdit) -> None:
    """Write a player; `read_player` gives back every number. The same player gives the same bytes.

    Args:
        path: the file.
        edit: the player; plans as of `to_stored_plan`.
    Raises:
        InputError: if the file cannot be written.
    """
    arrays, stretches = {}, []
    for index, stretch in enumerate(edit.stretches):
        stretches.append(_build_stretch_header(stretch))
        arrays |= {f"{index}/{name}": values for name, values in _build_stretch_arrays(stretch).items()}
    correction = edit.correction
    header = {
        "format": FORMAT, "version": VERSION, "player": edit.player, "window": edit.window, "stretches": stretches,
        "correction": None if correction is None else [correction.fps, correction.step],
    }  # fmt: skip
    if correction is not None:
        arrays |= {"knots": correction.knots, "values": correction.values}
    arrays[HEADER] = np.frombuffer(json.dumps(header, allow_nan=False).encode(), np.uint8)
    whole = io.BytesIO()
    np.savez_compressed(whole, **dict(sorted(arrays.items())))
    atomic_write(path, whole.getvalue())


def read_player(path: str | os.PathLike) -> PlayerEdit:
    """Read a player from a file.

    Args:
        path: the file.
    Returns:
        The player.
    Raises:
        InputError: one line that starts with the file's name, for anything that is wrong with it.
    """
    data = read_bytes(path, _KIND, MAX_FILE_BYTES)
    with name_file(path):
        return _parse_player(read_plain_arrays(data, _KIND, _TYPES, MAX_ARRAY_BYTES))


def pack_positions(metres: np.ndarray) -> np.ndarray:
    """Pack positions (N, k) m, NaN where unknown, to the millimetre, for `unpack_positions`."""
    return pack_differences(np.where(np.isnan(metres), _UNKNOWN, np.round(np.nan_to_num(metres) * 1000.0)))


def pack_differences(values: np.ndarray) -> np.ndarray:
    """Pack whole numbers (N, k) as second differences, in the smallest integer type that holds them."""
    once = np.diff(values.astype(np.int64), axis=0, prepend=0)
    twice = once.copy()
    twice[2:] = np.diff(once[1:], axis=0)
    most = np.abs(twice).max(initial=0)
    return twice.astype(next(kind for kind in ("<i2", "<i4", "<i8") if most <= np.iinfo(kind).max))


def unpack_positions(values: np.ndarray, where: str) -> np.ndarray:
    """Unpack (N, k) m that `pack_positions` packed; InputError at `where` unless they are whole numbers."""
    whole = unpack_differences(values, where)
    return np.where(whole == _UNKNOWN, np.nan, whole / 1000.0)


def unpack_differences(values: np.ndarray, where: str) -> np.ndarray:
    """Unpack what `pack_differences` packed, as floats; InputError at `where` unless they are whole numbers."""
    if values.dtype.kind != "i":
        raise InputError(where, f"values of type {values.dtype}", "whole numbers")
    once = values.astype(np.int64)
    once[1:] = np.cumsum(once[1:], axis=0)
    return np.cumsum(once, axis=0).astype(float)


# -- writing


def _build_stretch_header(stretch: Stretch) -> dict:
    """Build the part of the JSON header for a stretch."""
    plan, course = stretch.plan, stretch.plan.solved
    return {
        "name": plan.track.name, "settings": {name: getattr(plan, name) for name in _DEFAULTS},
        "spans": [[span.start, span.end, list(span.words), list(span.avoid)] for span in plan.timeline.spans],
        "keys": [[key.time, list(key.words), list(key.avoid), key.solved] for key in plan.timeline.keys],
        "pins": [asdict(pin) for pin in plan.pins], "headings": [asdict(key) for key in plan.heading_keys],
        "touches": None if course is None else [list(asdict(touch).values()) for touch in course.touches],
        "clips": [list(clip) for clip in stretch.edit.clips],
        "placed": [list(asdict(key).values()) for key in stretch.edit.keys],
        "warnings": [str(line) for line in stretch.warnings], "short": [list(span) for span in stretch.short],
        **({"bodies": [[body.first, body.fps, body.rotations.shape[1]] for body in plan.bodies]} if plan.bodies
           else {}),
    }  # fmt: skip


def _build_stretch_arrays(stretch: Stretch) -> dict[str, np.ndarray]:
    """Build the arrays of a stretch; `flags` has the bits 1 ball height known, 2 filled in, 4 outlier."""
    plan, track, course = stretch.plan, stretch.plan.track, stretch.plan.solved
    flags = track.ball_height_known + 2 * track.filled + 4 * track.outlier
    arrays = {name: getattr(stretch.edit, name).astype(kind) for name, kind in _RUN_TYPES.items()}
    arrays |= {"flags": flags.astype(np.uint8), "times": pack_differences(np.round(track.times * 1e6)[:, None]),
               "positions": pack_positions(track.positions), "ball": pack_positions(track.ball)}  # fmt: skip
    if plan.heading_path is not None:
        steps = np.column_stack([np.round(plan.heading_path.times * 1e6), plan.heading_path.bins])
        arrays |= {"heading_path": pack_differences(steps)}
    for number, body in enumerate(plan.bodies):
        arrays |= {f"body_{number}_root": pack_positions(body.root),
                   f"body_{number}_turns": body.rotations.reshape(len(body), -1),
                   f"body_{number}_contacts": body.heel_toe_contacts.reshape(-1, 4).astype(np.uint8)}
    if course is not None:
        arrays |= {"course": pack_positions(course.ball), "course_filled": course.filled.astype(np.uint8)}
    return arrays


# -- reading


def _parse_player(arrays: dict[str, np.ndarray]) -> PlayerEdit:
    """Parse a player from arrays; every array is used once and none is left over."""
    header = take_header(arrays, form=FORMAT, version=VERSION, kind=_KIND, page=_PAGE,
                         remedy="run the match again with this version")
    rows = ("format", "version", "player", "window", "stretches", "correction")
    check_names(header, HEADER, rows, rows)
    stretches = [_parse_stretch(row, index, arrays) for index,
                 row in enumerate(check_list(header["stretches"], "stretches"))]
    correction = _parse_correction(header["correction"], arrays)
    window = check_number(header["window"], "window")
    if window < _MIN_WINDOW:
        raise InputError("window", f"{window:g} s", f"{_MIN_WINDOW:g} s or more")
    if arrays:
        raise InputError("the arrays", f"{next(iter(arrays))[:40]!r}, which is not used", f"those of {_PAGE}")
    return PlayerEdit(check_text(header["player"], "player"), window, tuple(stretches), correction)


def _parse_correction(value, arrays: dict[str, np.ndarray]) -> Correction | None:
    if value is None:
        return None
    fps, step = _parse_row(value, "correction", 2)
    knots, values = arrays.pop("knots", None), arrays.pop("values", None)
    if knots is None or values is None or knots.dtype.kind != "i" or values.dtype != np.int16:
        raise InputError("correction", "knots or values are missing or not whole numbers", "both")
    return Correction(knots, values, check_number(fps, "correction"), check_whole_number(step, "correction"))


def _parse_stretch(row, index: int, arrays: dict[str, np.ndarray]) -> Stretch:
    """Parse a stretch from its header row and arrays."""
    where = f"stretch {index}"
    names = ("name", "settings", "spans", "keys", "pins", "touches", "clips", "placed", "warnings", "short")
    check_names(row, where, (*names, "headings", "bodies"), names)  # files of 0.1 have no headings

    def take_array(name: str, columns: int | None = None, count: int | None = None, is_needed: bool = True):
        values = arrays.pop(f"{index}/{name}", None)
        if values is None and not is_needed:
            return None
        ends = () if columns is None else (columns,)
        if values is None or values.shape[1:] != ends or values.ndim != 1 + len(ends):
            found = "no such array" if values is None else f"shape {values.shape}"
            raise InputError(f"{where}: {name}", found, f"(rows{''.join(f', {end}' for end in ends)})")
        if count is not None and len(values) != count:
            raise InputError(f"{where}: {name}", f"{len(values)} rows", str(count))
        return values

    return Stretch(
        _parse_plan(row, where, take_array), _parse_edit(row, where, take_array),
        tuple(check_text(line, f"{where}: warnings") for line in check_list(row["warnings"], f"{where}: warnings")),
        tuple(_parse_pair(span, f"{where}: short") for span in check_list(row["short"], f"{where}: short")),
    )  # fmt: skip


def _parse_pair(value, where: str) -> tuple[float, float]:
    start, end = _parse_row(value, where, 2)
    return check_number(start, where), check_number(end, where)


def _parse_row(value, where: str, count: int) -> list:
    row = check_list(value, where)
    if len(row) != count:
        raise InputError(where, describe_value(value), f"{count} values")
    return row


def _parse_plan(row, where: str, take_array) -> Plan:
    """Parse the plan of a stretch."""
    track, settings = _parse_track(row, where, take_array), _parse_settings(row["settings"], f"{where}: settings")
    first, last = track.times[0], track.times[-1]
    spans, keys = [], []
    for value in check_list(row["spans"], f"{where}: spans"):
        start, end, words, avoid = _parse_row(value, f"{where}: spans", 4)
        spans.append(Span(check_number(start, where), check_number(end, where), check_texts(words, where),
                          avoid=check_texts(avoid, where)))
    for value in check_list(row["keys"], f"{where}: keys"):
        time, words, avoid, solved = _parse_row(value, f"{where}: keys", 4)
        solved = None if solved is None else check_number(solved, where)
        keys.append(KeyMoment(check_number(time, where), check_texts(words, where), None, check_texts(avoid, where),
                              solved))
    pins = [_parse_pin(value, f"{where}: pins") for value in check_list(row["pins"], f"{where}: pins")]
    headings = [_parse_heading(value, f"{where}: headings")
                for value in check_list(row.get("headings", []), f"{where}: headings")]
    return Plan(
        track=track, timeline=Timeline(tuple(spans), tuple(keys)), pins=tuple(pins),
        heading_keys=tuple(headings), heading_path=_parse_heading_path(where, take_array),
        solved=_parse_trajectory(row, where, take_array, float(first), float(last)),
        bodies=_parse_bodies(row, where, take_array, settings.get("fps", _DEFAULTS["fps"])), **settings,
    )  # fmt: skip


def _parse_pin(value, where: str) -> Pin:
    names = ("time", "part", "position", "hold")
    check_names(value, where, names, names)
    place = check_numbers(value["position"], where, 3, "[x, y, z] m")
    return Pin(check_number(value["time"], where), check_text(value["part"], where), place,
               check_number(value["hold"], where))


def _parse_heading(value, where: str) -> HeadingKey:
    names = ("time", "heading", "target", "hold")
    check_names(value, where, names, names)
    heading, target = value["heading"], value["target"]
    return HeadingKey(check_number(value["time"], where), None if heading is None else check_number(heading, where),
                      None if target is None else check_numbers(target, where, 2, "[x, y] m"),
                      check_number(value["hold"], where))


def _parse_heading_path(where: str, take_array) -> HeadingPath | None:
    """Parse the planned heading of a stretch; None where it is planned when it is needed, as in files of 0.1."""
    steps = take_array("heading_path", 2, is_needed=False)
    if steps is None:
        return None
    values = unpack_differences(steps, f"{where}: heading_path")
    if not len(values) or np.any(np.diff(values[:, 0]) <= 0.0):
        raise InputError(f"{where}: heading_path", f"{len(values)} times", "one or more, ascending")
    return HeadingPath(values[:, 0] / 1e6, values[:, 1])


def _parse_bodies(row, where: str, take_array, rate: float) -> tuple[KnownBody, ...]:
    """Parse the bodies that cameras have seen, at the plan's frames per second."""
    bodies = []
    for number, value in enumerate(check_list(row.get("bodies", []), f"{where}: bodies")):
        first, fps, joints = _parse_row(value, f"{where}: bodies", 3)
        if check_number(fps, where) != rate:
            raise InputError(f"{where}: bodies", f"{fps:g} frames per second", f"{rate:g}, as the plan has")
        root = unpack_positions(take_array(f"body_{number}_root", 3), f"{where}: bodies")
        turns = take_array(f"body_{number}_turns", 4 * check_whole_number(joints, where), len(root))
        if np.isnan(root).any() or turns.dtype != np.int16 or not turns.reshape(len(root), -1, 4).any(axis=2).all():
            raise InputError(f"{where}: bodies", "an unknown pose", "root and rotations of every frame")
        contacts = take_array(f"body_{number}_contacts", 4, len(root)) > 0
        bodies.append(KnownBody(check_whole_number(first, where), rate, root,
                                turns.reshape(len(root), -1, 4), contacts.reshape(-1, 2, 2)))
    return tuple(bodies)


def _parse_settings(value, where: str) -> dict:
    """Parse a plan's plain settings, each of the type of its default; newer ones may be missing."""
    check_names(value, where, _DEFAULTS, ())
    kinds = {bool: check_bool, int: check_whole_number, float: check_number, str: check_text}
    out = {}
    for name, found in value.items():
        kind = kinds.get(type(_DEFAULTS[name]))
        out[name] = kind(found, f"{where}: {name}") if kind else _parse_texts(found, f"{where}: {name}")
    if out.get("method", METHODS[0]) != METHODS[0]:
        raise InputError(f"{where}: method", describe_value(out["method"]), METHODS[0])
    return out


def _parse_texts(value, where: str) -> tuple:
    """Parse texts, or pairs of texts."""
    rows = check_list(value, where)
    return tuple(check_text(row, where) if isinstance(row, str) else check_texts(_parse_row(row, where, 2), where)
                 for row in rows)


def _parse_track(row, where: str, take_array) -> Track:
    """Parse the track of a stretch."""
    times = unpack_differences(take_array("times", 1), f"{where}: times")[:, 0] / 1e6
    if len(times) < 2 or np.any(np.diff(times) <= 0.0) or times[-1] - times[0] > _MAX_STRETCH:
        raise InputError(f"{where}: times", f"{len(times)} times", "two or more, ascending, within a day")
    positions = unpack_positions(take_array("positions", 2, len(times)), f"{where}: positions")
    if np.isnan(positions).any():
        raise InputError(f"{where}: positions", "an unknown position", "a cleaned track")
    flags = take_array("flags", None, len(times)).astype(int)
    known, filled, outlier = ((flags & bit) > 0 for bit in (1, 2, 4))
    ball = unpack_positions(take_array("ball", 3, len(times)), f"{where}: ball")
    return Track(times, positions, ball, ball_height_known=known, filled=filled, outlier=outlier,
                 name=check_text(row["name"], f"{where}: name"))


def _parse_trajectory(row, where: str, take_array, first: float, last: float) -> SolvedTrajectory | None:
    """Parse the ball's trajectory of a stretch; None if it is not solved."""
    if row["touches"] is None:
        return None
    touches = []
    for value in check_list(row["touches"], f"{where}: touches"):
        time, mine, part, kind = _parse_row(value, f"{where}: touches", 4)
        mine = None if mine is None else check_bool(mine, where)
        touches.append(PlayerTouch(check_number(time, where), mine, check_text(part, where), check_text(kind, where)))
    times = build_ball_times(first, last, touches)
    ball = unpack_positions(take_array("course", 3, len(times)), f"{where}: course")
    return SolvedTrajectory(times, ball, take_array("course_filled", None, len(times)) > 0, tuple(touches))


def _parse_edit(row, where: str, take_array) -> NamedEdit:
    """Parse the edit list of a stretch."""
    clips = [_parse_row(value, f"{where}: clips", 2) for value in check_list(row["clips"], f"{where}: clips")]
    clips = tuple((check_text(path, where), check_bool(mirrored, where)) for path, mirrored in clips)
    first = take_array("first")
    runs = {name: first if name == "first" else take_array(name, None, len(first)) for name in _RUN_TYPES}
    length, clip = runs["length"], runs["clip"]
    if not len(first) or np.any(length < 1) or length.sum(dtype=np.int64) > _MAX_FRAMES:
        raise InputError(f"{where}: length", f"{len(first)} runs", "one or more, each of a frame or more, within a day")
    if np.any(clip < 0) or np.any(clip >= len(clips)):
        raise InputError(f"{where}: clip", f"{clip.min()} to {clip.max()}", f"0 to {len(clips) - 1}")
    if np.abs(first).max() > _MAX_FRAMES or np.abs(runs["rate"]).max() > _MAX_RATE:
        raise InputError(f"{where}: first, rate", "values too large for a clip", f"frames up to {_MAX_FRAMES:g}")
    keys = tuple(_parse_named_key(value, len(clips), where) for value in check_list(row["placed"], f"{where}: placed"))
    return NamedEdit(clips=clips, **runs, keys=keys)


def _parse_named_key(value, clips: int, where: str) -> NamedKey:
    time, clip, frame, start, end, words = _parse_row(value, f"{where}: placed", 6)
    if not 0 <= check_whole_number(clip, where) < clips:
        raise InputError(f"{where}: placed", f"clip {describe_value(clip)}", f"0 to {clips - 1}")
    frame, start, end = (check_number(each, f"{where}: placed") for each in (frame, start, end))
    return NamedKey(time=check_number(time, where), clip=check_whole_number(clip, where), frame=frame, start=start,
                    end=end, words=check_texts(words, where))
