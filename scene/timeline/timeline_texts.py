"""The texts of the timeline's overlay: what a strip or key moment is, what a drag does, and which keys there are."""

from __future__ import annotations

import bpy

from ..core.live import is_running
from ..core.measure import Clock, build_scene_clock
from ..player import dots
from . import label_tracks as lanes
from .label_groups import describe_contact, split_labels
from .library_offer import describe_offer
from .moment_names import DrawnName
from .strip_layout import DrawnStrip, Layout
from .strip_lines import format_labels, read_recorded_span

MOVES_MOMENT = ("BEYOND_MOCAP_OT_pick_moment",)
MOVED = 0.5  # frames from which a strip counts as dragged
KEYS = {
    "NLA_EDITOR": ("NLA Editor", (
        ("beyond_mocap.annotate", "Annotate"), ("transform.transform", "Move"), ("nla.split", "Split"),
        ("nla.duplicate_linked_move", "Duplicate"), ("nla.duplicate_move", "Duplicate"), ("nla.mute_toggle", "Mute"),
        ("nla.delete", "Delete"))),
    "DOPESHEET_EDITOR": ("Dopesheet", (("beyond_mocap.annotate", "Annotate"),)),
}  # editor -> Blender's keymap, operators with their titles

_keys: dict[str, list[str]] = {}


def list_keys(editor: str) -> list[str]:
    """List the keys of an editor's labels with what they do, as the user's key configuration has them."""
    if editor not in _keys:
        configuration = bpy.context.window_manager.keyconfigs.user
        keymap, operators = KEYS[editor]
        items = configuration.keymaps[keymap].keymap_items if configuration and keymap in configuration.keymaps else ()
        found = {}
        for operator, title in operators:
            item = next((item for item in items if item.idname == operator and item.active
                         and item.map_type == "KEYBOARD"), None)
            if item is not None:
                found.setdefault(title, f"{item.to_string()}: {title}")
        _keys[editor] = [*found.values(), "Drag a Name: Move"]
    return _keys[editor]


def forget_keys() -> None:
    """Forget the keys: they are read again when they are next drawn."""
    _keys.clear()


def describe_track(target: str) -> tuple[str, float]:
    """Describe the row of a dot's own keys: "Track of player1, 0.00 to 50.00 s", and the frame of the first."""
    dot = bpy.context.scene.objects[target]
    ends, clock, owner = dots.find_key_range(dot), find_clock(dot), dot.beyond_mocap_dot.player or "the ball"
    if ends is None:
        return f"Track of {owner}", 0.0
    seconds = [clock.to_seconds(end) for end in ends]
    return f"Track of {owner}, {seconds[0]:.2f} to {seconds[1]:.2f} s", ends[0]


def find_clock(target: bpy.types.Object) -> Clock:
    """Find the clock of an object's seconds."""
    return lanes.read_clock(target) or build_scene_clock(bpy.context.scene)


def describe_thing(context: bpy.types.Context, thing: DrawnName | DrawnStrip) -> list[str]:
    """Describe a key moment or strip in a few lines: labels, time, part of the body, what the library has."""
    target, words = context.scene.objects[thing.target], split_labels(thing.name)
    clock, is_span = find_clock(target), isinstance(thing, DrawnStrip)
    if is_span:
        start, end = clock.to_seconds(thing.first), clock.to_seconds(thing.last)
        when = f"{start:.2f} to {end:.2f} s    {end - start:.2f} s"
    else:
        when = f"{clock.to_seconds(thing.frame):.2f} s    frame {thing.frame}"
    contact = "" if is_span else describe_contact(words)
    notes = ["Automatic: from the last synthesis"] if is_span and thing.kind == "automatic" else (
        ["Muted: does not count"] if thing.is_muted else [])
    problems = [one.line for one in context.window_manager.beyond_mocap_problems.lines
                if not is_span and (one.target, one.frame) == (thing.target, thing.frame)]
    return [line for line in (f"{thing.name}    {thing.group.title}", "    ".join(filter(None, (when, contact))),
                              describe_offer(context.scene, words, is_span), *notes, *problems) if line]


def describe_drag(context: bpy.types.Context, layout: Layout) -> tuple[list[str], tuple[float, float]]:
    """Describe what is being dragged: seconds, by how much, and what the library has there.

    Args:
        context: of the editor.
        layout: as it is just now.
    Returns:
        Lines of text, none where nothing has moved, and the place in pixels to show them at.
    """
    for strip in layout.strips:
        if strip.is_selected and strip.kind != "moments":
            lines = _describe_moved_strip(context, strip)
            if lines:
                return lines, (max(strip.box[0], 0.0), strip.box[3])
    moved = [name for name in layout.names if name.is_selected]
    if moved and is_running(MOVES_MOMENT):
        return _describe_moved_moment(context, moved[0]), (moved[0].box[0], moved[0].box[3])
    return [], (0.0, 0.0)


def _describe_moved_strip(context, strip: DrawnStrip) -> list[str]:
    """Describe a strip that is not where its stored line says."""
    target = context.scene.objects[strip.target]
    recorded = read_recorded_span(lanes.find_strip(target, strip.strip).action)
    clock = find_clock(target)
    start, end = clock.to_seconds(strip.first), clock.to_seconds(strip.last)
    if recorded is None or max(abs(start - recorded.start), abs(end - recorded.end)) < MOVED / clock.fps:
        return []
    words = split_labels(format_labels(recorded))
    return [line for line in (f"{strip.name}    {start:.2f} ({start - recorded.start:+.2f}) to {end:.2f} "
                              f"({end - recorded.end:+.2f}) s", describe_offer(context.scene, words, True)) if line]


def _describe_moved_moment(context, name: DrawnName) -> list[str]:
    """Describe a key moment that is dragged; its stored line moves along, so only its new second is shown."""
    clock, words = find_clock(context.scene.objects[name.target]), split_labels(name.name)
    return [line for line in (f"{name.name}    {clock.to_seconds(name.frame):.2f} s",
                              describe_offer(context.scene, words, False)) if line]
