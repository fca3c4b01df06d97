"""The report: every figure of a player's take as JSON, and as text beside its targets."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from ..annotation import Timeline
from ..base.errors import InputError, format_count, line_spans
from ..library.library import Library
from ..motion.track import Track
from ..synthesis.quality.moments import measure_dribble_touches
from ..synthesis.quality.playback import Playback, playback_from_take
from ..synthesis.quality.targets import find_target
from ..synthesis.take import Take
from . import figures, naturalness_figures, physics_figures, touch_figures
from .annotation_similarity import measure_annotation_similarity
from .naturalness_figures import (
    find_asked_frames,
    find_planned_headings,
    list_naturalness_messages,
    measure_naturalness,
)
from .physics_figures import list_physics_notes, measure_physics
from .touch_figures import list_touch_messages, measure_touches
from .touch_view import TouchView
from .unknown_figures import list_unknown_figures
from .view import View

VERSION = 1
MAX_DEPTH = 30
"""Nesting depth that no report reaches."""

FRAMES_KEYS = {**naturalness_figures.FRAMES_KEYS, **touch_figures.FRAMES_KEYS, **physics_figures.FRAMES_KEYS}
"""What a figure rests on where that is not its group's `frames`: a key beside it."""

SECONDS = ("load", "library", "search", "construct", "polish", "total")


def evaluate(take: Take, track: Track | None, library: Library | None, played: Playback | None = None) -> dict:
    """Build the report of a take in memory.

    Args:
        take: the take.
        track: the player's samples as measured, seconds and metres, or None.
        library: the library it was synthesized from; without it there are no scores of the recordings.
        played: the take's playback, where there is one already.
    Returns:
        The report as plain values for JSON, None where a value is unknown.
    """
    played = played or playback_from_take(take)
    report = evaluate_played(
        played, track=track, timeline=take.timeline, library=library, ik_miss=take.ik_miss,
        requested=take.plan.timeline if take.plan else Timeline(),
    )
    seconds = {name: take.seconds.get(name) for name in (*SECONDS, *(s for s in take.seconds if s not in SECONDS))}
    warnings = list(dict.fromkeys((*take.warnings, *report["warnings"])))
    pins = [{"time_s": p.pin.time, "part": p.pin.part, "miss": p.miss} for p in take.pins]
    out = {**report, "seed": take.seed, "seconds": round_values(seconds), "method": take.method, "warnings": warnings,
           "warning_seconds": list_message_spans(warnings)}
    if pins:
        out["pins"] = round_values(pins)
    if take.solved is not None:
        out["dribbles"] = round_values(measure_dribble_touches(played, take.dribble_touches, track))
    return out


def evaluate_played(
    played: Playback, *, track: Track | None = None, timeline: Timeline | None = None, library: Library | None = None,
    ik_miss: np.ndarray | None = None, requested: Timeline | None = None,
) -> dict:  # fmt: skip
    """Build the report of a motion with its sources.

    They come from memory (`playback_from_take`) or files (`playback_from_tables`).

    Args:
        played: the motion with its sources, T frames.
        track: the player's track, or None.
        timeline: the timeline, or None.
        library: the library, or None.
        ik_miss: (T,) or (T, 2) m by which inverse kinematics missed its targets, or None.
        requested: the user's own timeline if `timeline` includes automatic spans.
    Returns:
        The report as plain values for JSON, None where a value is unknown.
    Raises:
        InputError: if the library has another skeleton than the motion.
    """
    view = View(played, track, timeline, library)
    touch_view = TouchView(view)
    user_timeline = timeline if requested is None else requested
    heading, asked = find_planned_headings(view), find_asked_frames(view, user_timeline)
    events, notes = list_naturalness_messages(view, heading, asked)
    report = {
        "version": VERSION, "seed": None, "fps": played.motion.fps, "frames": len(played.motion),
        "duration_s": played.motion.duration, "seconds": dict.fromkeys(SECONDS), **figures.measure_path_errors(view),
        "keys": figures.measure_key_moments(view), **figures.measure_feet(view),
        **figures.measure_corrections(view, ik_miss), **figures.measure_transitions(view),
        **figures.measure_poses(view), **measure_naturalness(view, heading, asked),
        **measure_physics(view), **measure_touches(touch_view),
        "annotation_similarity": measure_annotation_similarity(view),
        "warnings": [*figures.list_warnings(view, ik_miss, requested), *events, *list_touch_messages(touch_view)],
        "notes": [*notes, *list_physics_notes(view)],
    }
    out = round_values(report)
    return {**out, "warning_seconds": list_message_spans(report["warnings"]),
            "unknown": list_unknown_figures(flatten_report(out), view)}


def list_message_spans(lines: list[str]) -> list[list[list[float]]]:
    """List for each line the spans [first, last] in seconds that it refers to.

    Args:
        lines: messages of a take.
    """
    return [[[round(edge, 3) for edge in span] for span in line_spans(line)] for line in lines]


def round_values(value):
    """Round all floats to five significant digits, or three decimals where those are more, and convert to plain values.

    A key moment late in a half keeps its frame.

    Args:
        value: a report or a part of it.
    Returns:
        The same with NaN and infinity as None and numpy numbers as Python's.
    """
    if value is None or isinstance(value, str):
        return value
    if isinstance(value, (float, np.floating)):
        if not math.isfinite(value):
            return None
        return round(float(value), 3) if abs(value) >= 100.0 else float(f"{round(float(value), 9) + 0.0:.5g}")
    if isinstance(value, (list, tuple)):
        return [round_values(entry) for entry in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, Mapping):
        return {key: round_values(entry) for key, entry in value.items()}
    return value


def check_depth(value, where: object) -> None:
    """Check that a value from JSON is not nested deeper than any report.

    Args:
        value: the value.
        where: its file, for the error.
    Raises:
        InputError: if it is.
    """
    level, depth = [value], 0
    while level:
        if depth > MAX_DEPTH:
            raise InputError(where, f"nested more than {MAX_DEPTH} levels deep", "a report", "write the report again")
        inner = [list(one.values()) if isinstance(one, Mapping) else one for one in level
                 if isinstance(one, (Mapping, list))]  # fmt: skip
        level, depth = [entry for entries in inner for entry in entries], depth + 1


def flatten_report(report: Mapping) -> dict[str, Any]:
    """Flatten a report to one row per figure.

    Args:
        report: the report.
    Returns:
        Name -> value: nested names joined with dots, key moments numbered from 1, warnings and notes counted; without
        the reasons for unknown figures.
    Raises:
        InputError: see `check_depth`.
    """
    check_depth(report, "report")
    return _flatten(report, "")


def _flatten(value, name: str) -> dict[str, Any]:
    if name in ("warnings", "notes"):
        return {name: len(value)}
    if name in ("warning_seconds", "unknown"):
        return {}
    if isinstance(value, Mapping):
        return {k: v for key, entry in value.items() for k,
                v in _flatten(entry, f"{name}.{key}" if name else key).items()}
    if isinstance(value, list) and any(isinstance(entry, Mapping) for entry in value):
        pairs = [(f"{name} {i}", entry) for i, entry in enumerate(value, 1)]
        return {k: v for label, entry in pairs for k, v in _flatten(entry, label).items()}
    return {name: value}


class Row(NamedTuple):
    """One figure as text.

    Attributes:
        name: name of the figure, with dots.
        value: the take's value.
        own: the recordings' score.
        target: the target, or "".
        status: "met", "missed" or "".
        rests_on: what the recordings' score rests on, such as "1,032 frames", or "".
        reason: why the value is not known, or "".
    """

    name: str
    value: str
    own: str
    target: str
    status: str
    rests_on: str = ""
    reason: str = ""


def judge_figures(report: Mapping) -> Iterator[Row]:
    """Compare every figure of a report with its target.

    Args:
        report: from `evaluate`.
    Returns:
        A row for each figure that is known or has a target.
    """
    table, unknown = flatten_report(report), report.get("unknown") or {}
    fps = float(report.get("fps") or 30.0)
    for name, value in table.items():
        leaf, target = name.rpartition(".")[2], find_target(name, fps)
        if leaf.startswith("source_") or leaf in ("own", "own_frames") or (value is None and target is None):
            continue
        twin = find_twin_name(name, table)
        own = table.get(twin)
        is_met = target.is_met(value, table) if target and isinstance(value, (int, float)) else None
        status = "" if is_met is None else ("met" if is_met else "missed")
        target_text = target.describe(table) if target else ""
        rests_on = "" if own is None else format_rest(twin, table)
        reason = unknown.get(name, "") if value is None else ""
        yield Row(name, _format_value(value), _format_value(own, ""), target_text, status=status, rests_on=rests_on,
                  reason=str(reason))


def describe_figures(report: Mapping) -> list[str]:
    """Describe how many targets are met, which ones are missed, and which figures with a target are not known.

    Args:
        report: from `evaluate`.
    Returns:
        Lines of text.
    """
    rows = list(judge_figures(report))
    judged, missed = [row for row in rows if row.status], [row for row in rows if row.status == "missed"]
    lines = [f"{len(judged) - len(missed)} of {len(judged)} targets met"]
    for row in missed:
        own = f"; recordings {row.own}" + (f" over {row.rests_on}" if row.rests_on else "") if row.own else ""
        lines.append(f"missed: {row.name} {row.value} (target {row.target}{own})")
    return lines + [f"not known: {row.name}, {row.reason}" for row in rows if row.reason]


def find_count_name(name: str, table: Mapping[str, Any]) -> str:
    """Find the name of the frames, pieces, strides or seconds that a figure rests on.

    Args:
        name: dotted name of the figure.
        table: figures by name, all of them or those of its group.
    Returns:
        A name in the table, "" where it has none.
    """
    group, dot, leaf = name.rpartition(".")
    begin = "own_" if leaf == "own" else "source_" if leaf.startswith("source_") else ""
    key = FRAMES_KEYS.get(leaf.removeprefix("source_"), "frames")
    count = f"{group}{dot}{begin}{key}"
    return count if count in table and count != name else ""


def find_twin_name(name: str, table: Mapping[str, Any]) -> str:
    """Find the name of the recordings' own figure beside a figure; the table need not have it."""
    group, dot, leaf = name.rpartition(".")
    return f"{group}.own" if leaf == "mean" and f"{group}.own" in table else f"{group}{dot}source_{leaf}"


def format_rest(name: str, table: Mapping[str, Any]) -> str:
    """Format what a figure rests on: "1,032 frames", "12 strides", "5.1 s"; "" where it is not known."""
    count = find_count_name(name, table)
    value, unit = table.get(count), count.rpartition("_")[2].rpartition(".")[2]
    if not isinstance(value, (int, float)):
        return ""
    return f"{value:.1f} s" if unit == "seconds" else format_count(int(value), unit.removesuffix("s"))


def _format_value(value, unknown: str = "–") -> str:
    if value is None:
        return unknown
    if isinstance(value, list):
        return " ".join(map(str, value)) or unknown
    return f"{value:.4g}" if isinstance(value, float) else str(value)
