"""Annotation by keys: what the library has, where the playhead is, and commands carried out on strips.

The labels go to the active player's dot; if a clip with label tracks is the active object, to that clip.
"""

from __future__ import annotations

import weakref
from dataclasses import replace
from typing import NamedTuple

import bpy
import numpy as np

from ...beyond_mocap.annotation import KeyMoment, Span, swap_sides
from ...beyond_mocap.annotation import key_commands as annotating
from ...beyond_mocap.annotation.decision import LibraryCombinations
from ...beyond_mocap.annotation.key_commands import (
    AddMoment,
    AddSpan,
    ChangeAtPlayhead,
    Command,
    GoToNeighbour,
    Playhead,
    ShowMessage,
)
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.fixes import Fix
from ..core import session
from ..core.measure import Clock, build_scene_clock
from ..core.settings import find_active_player, to_absolute_path
from . import label_checks as word_checks
from . import label_tracks as lanes
from . import strip_writing as lay_strips
from . import strips
from .label_tracks import PlacedMoment, PlacedSpan

AT_PLAYHEAD = 0.06
"""Seconds from the playhead within which a key moment counts as there, at least a frame."""

_combination_cache: weakref.WeakKeyDictionary = weakref.WeakKeyDictionary()


def find_combinations(scene: bpy.types.Scene) -> LibraryCombinations | None:
    """Find what the library built from the scene's folder has; None if none is built."""
    settings = scene.beyond_mocap
    library = session.find_library(to_absolute_path(settings.library_folder), settings.library_unit or None)
    if library is None:
        return None
    cached = _combination_cache.setdefault(library, {})
    choices = settings.mirror, settings.made
    if choices not in cached:
        cached[choices] = _collect_combinations(library, *choices)
    return cached[choices]


def describe_subject(context: bpy.types.Context) -> str:
    """Describe the target of annotation; empty without one."""
    target, player = strips.find_target(context), find_active_player(context.scene.beyond_mocap)
    return strips.describe_target(target) if target is not None else player.name if player is not None else ""


def compute_now(context: bpy.types.Context) -> Playhead:
    """Compute the playhead on the target's clock. Raises InputError without a target."""
    target = strips.find_target(context)
    if target is None and not strips.can_have_timeline(context):
        raise InputError("annotate", "there is no player", "a player in the list", "import tracking in step 2 first",
                         fixes=(Fix("add_track"),))
    clock = build_scene_clock(context.scene) if target is None else strips.find_target_clock(context, target)
    time = clock.to_seconds(context.scene.frame_current_final)
    ends = [placed.span.end for placed in _list_active_spans(target)] + [placed.time
                                                                         for placed in _list_active_moments(target)]
    return Playhead(time, 1.0 / clock.fps, max((end for end in ends if end < time - 0.5 / clock.fps), default=None))


class CommandResult(NamedTuple):
    """The result of a command.

    Attributes:
        line: for the user.
        changed_labels: whether labels changed, which makes it an undo step.
    """

    line: str
    changed_labels: bool = False


def run_command(context: bpy.types.Context, command: Command) -> CommandResult:
    """Carry out one command on the strips or the scene. Raises InputError, and changes nothing, if it cannot."""
    done = _run_command(context, command)
    if done.changed_labels:
        word_checks.update_problems(context)
    return done


def type_keys(context: bpy.types.Context, keys: list[str]) -> list[str]:
    """Simulate pressing these keys with the playhead where it is; returns a line for each command."""
    state, lines = annotating.AnnotationState(find_combinations(context.scene)), []
    for key in keys:
        state, commands = annotating.handle_key(state, key, compute_now(context))
        lines += [run_command(context, command).line for command in commands]
    return lines


def _run_command(context: bpy.types.Context, command: Command) -> CommandResult:
    """Run a command by its type."""
    if isinstance(command, AddMoment):
        return CommandResult(_add_moment(context, KeyMoment(command.time, command.words)), True)
    if isinstance(command, AddSpan):
        return CommandResult(_add_span(context, Span(command.start, command.end, command.words)), True)
    if isinstance(command, ChangeAtPlayhead):
        return _edit_at_playhead(context, command.what)
    if isinstance(command, GoToNeighbour):
        return CommandResult(
            _go_to_player(context, command.step) if command.to == "player" else _go_to_moment(context, command.step)
        )
    return CommandResult(command.line if isinstance(command, ShowMessage) else "")


def _collect_combinations(library, mirror: bool, has_synthetic: bool) -> LibraryCombinations:
    from ...beyond_mocap.library.missing_actions import list_action_labels

    is_allowed = np.array([mirror or not clip.mirrored for clip in library.clips])
    recorded = [key for key in library.keys if is_allowed[key.clip] and not library.clips[key.clip].is_synthetic]
    frames = library.frames
    rows = np.unique(frames.words[is_allowed[frames.clip]], axis=0)
    spans = (frozenset(word for word, has in zip(frames.vocabulary, row) if has) for row in rows)
    added = [list_action_labels(is_span) if has_synthetic else () for is_span in (False, True)]
    moments = dict.fromkeys((*(frozenset(key.labels) for key in recorded), *added[0]))
    return LibraryCombinations(tuple(moments), (*spans, *added[1]))


def _list_active_moments(target: bpy.types.Object | None) -> list[PlacedMoment]:
    return [] if target is None else [moment for moment in lanes.list_moments(target) if not moment.is_muted]


def _list_active_spans(target: bpy.types.Object | None) -> list[PlacedSpan]:
    return [] if target is None else [span for span in lanes.list_spans(target)
                                      if not (span.is_muted or span.is_automatic)]


def _add_moment(context: bpy.types.Context, key: KeyMoment) -> str:
    """Add a key moment; one on the same frame gets the new labels instead."""
    target = strips.ensure_target(context)
    clock = strips.find_target_clock(context, target)
    there = next((moment for moment in _list_active_moments(target) if moment.frame == clock.to_whole_frame(key.time)),
                 None)
    if there is not None:
        lay_strips.change_moment(target, there.strip, there.index, replace(there.key, words=key.words))
        return f"{_format_labels(key.words)} at {there.time:.2f} s, in place of {_format_labels(there.labels)}"
    lay_strips.add_moment(target, key, clock)
    return f"{_format_labels(key.words)} at {key.time:.2f} s"


def _add_span(context: bpy.types.Context, span: Span) -> str:
    target = strips.ensure_target(context)
    active_spans = [placed.span for placed in _list_active_spans(target) if placed.span.words]
    others = [one for one in active_spans if one.start < span.end - 1e-6 and span.start < one.end - 1e-6]
    lay_strips.add_span(target, span, strips.find_target_clock(context, target))
    over = f"; it overlaps {_format_labels(others[0].words)}, shorten one of them" if others else ""
    return f"{_format_labels(span.words)} from {span.start:.2f} to {span.end:.2f} s{over}"


def _edit_at_playhead(context: bpy.types.Context, what: str) -> CommandResult:
    """Edit the item at the playhead: nudge, mirror or remove it; without a key moment, move the playhead."""
    target = strips.find_target(context)
    clock = build_scene_clock(context.scene) if target is None else strips.find_target_clock(context, target)
    found = None if target is None else _find_at_playhead(context, target, clock)
    if what in ("earlier", "later"):
        step = 1 if what == "later" else -1
        if isinstance(found, PlacedMoment):
            return CommandResult(_nudge_moment(context, target, found, clock, step), True)
        context.scene.frame_float += step
        return CommandResult(f"{clock.to_seconds(context.scene.frame_current_final):.2f} s")
    if found is None:
        raise InputError("playhead", "is on no key moment or span", "a key moment or span", "go to one first")
    return CommandResult(_mirror_item(target, found) if what == "mirror" else _remove_item(target, found), True)


def _find_at_playhead(context, target, clock: Clock) -> PlacedMoment | PlacedSpan | None:
    """Find the key moment nearest to the playhead within a frame or AT_PLAYHEAD, else the span there."""
    time = clock.to_seconds(context.scene.frame_current_final)
    reach = max(AT_PLAYHEAD, 1.0 / clock.fps) + 1e-6
    near = [moment for moment in _list_active_moments(target) if abs(moment.time - time) <= reach]
    if near:
        return min(near, key=lambda moment: abs(moment.time - time))
    span = lanes.find_span(target, time)
    return None if span is None or span.is_automatic else span


def _mirror_item(target, found: PlacedMoment | PlacedSpan) -> str:
    """Swap left and right in the labels of an item."""
    item = found.key if isinstance(found, PlacedMoment) else found.span
    other = replace(item, words=swap_sides(item.words), avoid=swap_sides(item.avoid))
    if other == item:
        raise InputError(_format_labels(item.words), "has no side", "left or right", "choose one from the menu")
    if isinstance(found, PlacedMoment):
        lay_strips.change_moment(target, found.strip, found.index, other)
    else:
        lay_strips.change_span(target, found.strip, other)
    return f"{_format_labels(item.words)} is now {_format_labels(other.words)}"


def _remove_item(target, found: PlacedMoment | PlacedSpan) -> str:
    if isinstance(found, PlacedMoment):
        lay_strips.remove_moment(target, found.strip, found.index)
        return f"{_format_labels(found.labels)} removed"
    lay_strips.remove_span(target, found.strip)
    return f"{_format_labels(found.span.words)} removed"


def _nudge_moment(context, target, found: PlacedMoment, clock: Clock, step: int) -> str:
    key = replace(found.key, time=round(found.time + step / clock.fps, 6))
    _show_moment(context, lay_strips.change_moment(target, found.strip, found.index, key), clock)
    return f"{_format_labels(key.words)} at {key.time:.2f} s"


def _go_to_moment(context: bpy.types.Context, step: int) -> str:
    """Move the playhead to the next or previous key moment and select it."""
    target = strips.find_target(context)
    clock = build_scene_clock(context.scene) if target is None else strips.find_target_clock(context, target)
    time = clock.to_seconds(context.scene.frame_current_final)
    candidates = [moment for moment in _list_active_moments(target) if step * (moment.time - time) > 0.75 / clock.fps]
    if not candidates:
        return "no key moment " + ("after" if step > 0 else "before") + " this one"
    moment = min(candidates, key=lambda m: step * m.time)
    lay_strips.select_moment(target, moment.strip, moment.index)
    _show_moment(context, moment, clock)
    return f"{_format_labels(moment.labels)} at {moment.time:.2f} s"


def _show_moment(context: bpy.types.Context, moment: PlacedMoment, clock: Clock) -> None:
    """Put the playhead on a key moment: between frames if the scene shows subframes, else on its marker."""
    scene = context.scene
    frame = clock.to_frame(moment.time) if scene.show_subframe else float(moment.frame)
    scene.frame_float = frame  # frame_set would leave the movie clip editors behind


def _go_to_player(context: bpy.types.Context, step: int) -> str:
    """Make the neighbour in the list active and select their dot if possible, so that the NLA editor shows it."""
    settings = context.scene.beyond_mocap
    if not settings.players:
        return "no player"
    settings.active_player = min(max(settings.active_player + step, 0), len(settings.players) - 1)
    if context.mode == "OBJECT":
        strips.show_player(context, settings.players[settings.active_player])
    return describe_subject(context)


def _format_labels(words: tuple[str, ...]) -> str:
    return " ".join(words) or "automatic"
