"""Annotation by keys: what the library has, where the playhead is, and commands carried out on strips.

The labels go to the active player's dot; if a clip with label tracks is the active object, to that clip.
"""

from __future__ import annotations

import weakref
from dataclasses import replace
from typing import NamedTuple

import bpy
import numpy as np

from ...beyond_mocap.annotation import KeyMoment, Span, annotating, swap_sides
from ...beyond_mocap.annotation.annotating import AddMoment, AddSpan, AtPlayhead, Command, Go, Now, Tell
from ...beyond_mocap.annotation.decision import Held
from ...beyond_mocap.base.errors import InputError
from ..core import session
from ..core.measure import Clock, scene_clock
from ..core.settings import absolute, active_player
from . import lanes, lay_strips, strips, word_checks
from .lanes import PlacedMoment, PlacedSpan

AT_PLAYHEAD = 0.06
"""Seconds from the playhead within which a key moment counts as there, at least a frame."""

_held: weakref.WeakKeyDictionary = weakref.WeakKeyDictionary()


def held(scene: bpy.types.Scene) -> Held | None:
    """Find what the library built from the scene's folder has; None if none is built."""
    settings = scene.beyond_mocap
    library = session.library(absolute(settings.library_folder), settings.library_unit or None)
    if library is None:
        return None
    kept = _held.setdefault(library, {})
    if settings.mirror not in kept:
        kept[settings.mirror] = _combinations(library, settings.mirror)
    return kept[settings.mirror]


def name_of(context: bpy.types.Context) -> str:
    """Describe the target of annotation; empty without one."""
    target, player = strips.timeline_subject(context), active_player(context.scene.beyond_mocap)
    return strips.subject_name(target) if target is not None else player.name if player is not None else ""


def now(context: bpy.types.Context) -> Now:
    """Compute the playhead on the target's clock. Raises InputError without a target."""
    target = strips.timeline_subject(context)
    if target is None and not strips.can_have_timeline(context):
        raise InputError("annotate", "there is no player", "a player in the list", "import tracking in step 2 first")
    clock = scene_clock(context.scene) if target is None else strips.subject_clock(context, target)
    time = clock.seconds(context.scene.frame_current_final)
    ends = [placed.span.end for placed in _asked_spans(target)] + [placed.time for placed in _asked_moments(target)]
    return Now(time, 1.0 / clock.fps, max((end for end in ends if end < time - 0.5 / clock.fps), default=None))


class Done(NamedTuple):
    """The result of a command.

    Attributes:
        line: for the user.
        changed_labels: whether labels changed, which makes it an undo step.
    """

    line: str
    words: bool = False


def do(context: bpy.types.Context, command: Command) -> Done:
    """Carry out one command on the strips or the scene. Raises InputError, and changes nothing, if it cannot."""
    done = _done(context, command)
    if done.words:
        word_checks.keep(context)
    return done


def type_keys(context: bpy.types.Context, keys: list[str]) -> list[str]:
    """Simulate pressing these keys with the playhead where it is; returns a line for each command."""
    state, told = annotating.State(held(context.scene)), []
    for key in keys:
        state, commands = annotating.press(state, key, now(context))
        told += [do(context, command).line for command in commands]
    return told


def _done(context: bpy.types.Context, command: Command) -> Done:
    """Run a command by its type."""
    if isinstance(command, AddMoment):
        return Done(_add_moment(context, KeyMoment(command.time, command.words)), True)
    if isinstance(command, AddSpan):
        return Done(_add_span(context, Span(command.start, command.end, command.words)), True)
    if isinstance(command, AtPlayhead):
        return _at_playhead(context, command.what)
    if isinstance(command, Go):
        return Done(
            _next_player(context, command.step) if command.to == "player" else _next_moment(context, command.step)
        )
    return Done(command.line if isinstance(command, Tell) else "")


def _combinations(library, mirror: bool) -> Held:
    allowed = np.array([mirror or not clip.mirrored for clip in library.clips])
    recorded = [key for key in library.keys if allowed[key.clip] and not library.clips[key.clip].made]
    frames = library.frames
    rows = np.unique(frames.words[allowed[frames.clip]], axis=0)
    spans = (frozenset(word for word, has in zip(frames.vocabulary, row) if has) for row in rows)
    return Held(tuple(dict.fromkeys(frozenset(key.words) for key in recorded)), tuple(spans))


def _asked_moments(target: bpy.types.Object | None) -> list[PlacedMoment]:
    return [] if target is None else [moment for moment in lanes.moments(target) if not moment.off]


def _asked_spans(target: bpy.types.Object | None) -> list[PlacedSpan]:
    return [] if target is None else [span for span in lanes.spans(target) if not (span.off or span.automatic)]


def _add_moment(context: bpy.types.Context, key: KeyMoment) -> str:
    """Add a key moment; one on the same frame gets the new labels instead."""
    target = strips.subject_with_lanes(context)
    clock = strips.subject_clock(context, target)
    there = next((moment for moment in _asked_moments(target) if moment.frame == clock.whole(key.time)), None)
    if there is not None:
        lay_strips.change_moment(target, there.strip, there.index, replace(there.key, words=key.words))
        return f"{_spoken(key.words)} at {there.time:.2f} s, in place of {_spoken(there.words)}"
    lay_strips.add_moment(target, key, clock)
    return f"{_spoken(key.words)} at {key.time:.2f} s"


def _add_span(context: bpy.types.Context, span: Span) -> str:
    target = strips.subject_with_lanes(context)
    asked = [placed.span for placed in _asked_spans(target) if placed.span.words]
    others = [one for one in asked if one.start < span.end - 1e-6 and span.start < one.end - 1e-6]
    lay_strips.add_span(target, span, strips.subject_clock(context, target))
    over = f"; it overlaps {_spoken(others[0].words)}, shorten one of them" if others else ""
    return f"{_spoken(span.words)} from {span.start:.2f} to {span.end:.2f} s{over}"


def _at_playhead(context: bpy.types.Context, what: str) -> Done:
    """Edit the item at the playhead: nudge, mirror or remove it; without a key moment, move the playhead."""
    target = strips.timeline_subject(context)
    clock = scene_clock(context.scene) if target is None else strips.subject_clock(context, target)
    found = None if target is None else _found(context, target, clock)
    if what in ("earlier", "later"):
        step = 1 if what == "later" else -1
        if isinstance(found, PlacedMoment):
            return Done(_nudge(context, target, found, clock, step), True)
        context.scene.frame_float += step
        return Done(f"{clock.seconds(context.scene.frame_current_final):.2f} s")
    if found is None:
        raise InputError("playhead", "is on no key moment or span", f"one to {what}", "go to one first")
    return Done(_mirror(target, found) if what == "mirror" else _remove(target, found), True)


def _found(context, target, clock: Clock) -> PlacedMoment | PlacedSpan | None:
    """Find the key moment nearest to the playhead within a frame or AT_PLAYHEAD, else the span there."""
    time = clock.seconds(context.scene.frame_current_final)
    reach = max(AT_PLAYHEAD, 1.0 / clock.fps) + 1e-6
    near = [moment for moment in _asked_moments(target) if abs(moment.time - time) <= reach]
    if near:
        return min(near, key=lambda moment: abs(moment.time - time))
    span = lanes.span_at(target, time)
    return None if span is None or span.automatic else span


def _mirror(target, found: PlacedMoment | PlacedSpan) -> str:
    """Swap left and right in the labels of an item."""
    item = found.key if isinstance(found, PlacedMoment) else found.span
    other = replace(item, words=swap_sides(item.words), avoid=swap_sides(item.avoid))
    if other == item:
        raise InputError(_spoken(item.words), "has no side", "left or right", "choose one from the menu")
    if isinstance(found, PlacedMoment):
        lay_strips.change_moment(target, found.strip, found.index, other)
    else:
        lay_strips.change_span(target, found.strip, other)
    return f"{_spoken(item.words)} is now {_spoken(other.words)}"


def _remove(target, found: PlacedMoment | PlacedSpan) -> str:
    if isinstance(found, PlacedMoment):
        lay_strips.remove_moment(target, found.strip, found.index)
        return f"{_spoken(found.words)} removed"
    lay_strips.remove_span(target, found.strip)
    return f"{_spoken(found.span.words)} removed"


def _nudge(context, target, found: PlacedMoment, clock: Clock, step: int) -> str:
    key = replace(found.key, time=round(found.time + step / clock.fps, 6))
    _show(context, lay_strips.change_moment(target, found.strip, found.index, key), clock)
    return f"{_spoken(key.words)} at {key.time:.2f} s"


def _next_moment(context: bpy.types.Context, step: int) -> str:
    """Move the playhead to the next or previous key moment and select it."""
    target = strips.timeline_subject(context)
    clock = scene_clock(context.scene) if target is None else strips.subject_clock(context, target)
    time = clock.seconds(context.scene.frame_current_final)
    ahead = [moment for moment in _asked_moments(target) if step * (moment.time - time) > 0.75 / clock.fps]
    if not ahead:
        return "no key moment " + ("after" if step > 0 else "before") + " this one"
    moment = min(ahead, key=lambda m: step * m.time)
    lay_strips.pick(target, moment.strip, moment.index)
    _show(context, moment, clock)
    return f"{_spoken(moment.words)} at {moment.time:.2f} s"


def _show(context: bpy.types.Context, moment: PlacedMoment, clock: Clock) -> None:
    """Put the playhead on a key moment: between frames if the scene shows subframes, else on its marker."""
    scene = context.scene
    frame = clock.frame(moment.time) if scene.show_subframe else float(moment.frame)
    scene.frame_float = frame  # frame_set would leave the movie clip editors behind


def _next_player(context: bpy.types.Context, step: int) -> str:
    """Make the neighbour in the list active and select their dot if possible, so that the NLA editor shows it."""
    settings = context.scene.beyond_mocap
    if not settings.players:
        return "no player"
    settings.active_player = min(max(settings.active_player + step, 0), len(settings.players) - 1)
    if context.mode == "OBJECT":
        strips.show_player(context, settings.players[settings.active_player])
    return name_of(context)


def _spoken(words: tuple[str, ...]) -> str:
    return " ".join(words) or "automatic"
