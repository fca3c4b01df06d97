"""What is drawn over the NLA editor and the dope sheet: strips in the colour of their action, key moments as diamonds,
names, a calm bar over each dot's own keys, the legend, the keys, and what is under the pointer or being dragged.

All rectangles and diamonds of an editor are one batch, so that a hundred strips take a few milliseconds.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ..core.live import Watcher, call_guarded, call_soon, is_running
from . import label_groups as groups
from . import moment_names as names
from . import strip_layout, timeline_texts

if TYPE_CHECKING:
    from .label_groups import LabelGroup
    from .moment_names import DrawnName
    from .strip_layout import DrawnStrip, Layout

DRAGGING = ("TRANSFORM_OT_", "NLA_OT_", "BEYOND_MOCAP_OT_pick_moment")
FOOT = 21  # points: lower edge of the line with keys and legend
SMALL = 10  # points: letters of that line
EDGE = 2  # points: outline of what is selected
HOVER_SECONDS = 4.0  # after the last move of the pointer
INK, PAPER = (0.95, 0.95, 0.95), (0.09, 0.09, 0.09)

_hover: dict = {}  # the region under the pointer, the place, the time, the key moment or strip there


class Canvas:
    """Rectangles and diamonds of one draw, as triangles in pixels; drawn at once."""

    def __init__(self):
        self.corners, self.colours, self.texts = [], [], []

    def add_box(self, box, colour, alpha: float = 1.0) -> None:
        """Add a rectangle: left, bottom, right, top."""
        left, bottom, right, top = box
        if right > left and top > bottom:
            self._add_square(((left, bottom), (right, bottom), (right, top), (left, top)), (*colour, alpha))

    def add_frame(self, box, width: float, colour) -> None:
        """Add an outline within a rectangle."""
        left, bottom, right, top = box
        for edge in ((left, bottom, right, bottom + width), (left, top - width, right, top),
                     (left, bottom, left + width, top), (right - width, bottom, right, top)):
            self.add_box(edge, colour)

    def add_diamond(self, x: float, y: float, half: float, colour) -> None:
        """Add a diamond."""
        self._add_square(((x - half, y), (x, y - half), (x + half, y), (x, y + half)), (*colour, 1.0))

    def add_text(self, place: tuple[float, float], text: str, size: float, colour, alpha: float = 1.0) -> None:
        """Add a text that begins at a place on its baseline; it is drawn over all shapes."""
        if text:
            self.texts.append((place, text, size, (*colour, alpha)))

    def draw(self) -> None:
        """Draw all shapes, then all texts."""
        gpu.state.blend_set("ALPHA")
        if self.corners:
            points = np.array(self.corners, np.float32)[:, (0, 1, 2, 0, 2, 3)].reshape(-1, 2)
            colours = np.repeat(np.array(self.colours, np.float32), 6, axis=0)
            shader = gpu.shader.from_builtin("SMOOTH_COLOR")
            batch_for_shader(shader, "TRIS", {"pos": points, "color": colours}).draw(shader)
        for place, text, size, colour in self.texts:
            blf.size(0, size)
            blf.color(0, *colour)
            blf.position(0, *place, 0)
            blf.draw(0, text)
        gpu.state.blend_set("NONE")

    def _add_square(self, corners, colour) -> None:
        self.corners.append(corners)
        self.colours.append(colour)


def draw() -> None:
    """Draw everything; the draw handler of both editors."""
    call_guarded("Labels of the timeline", _draw)


def move_pointer(context: bpy.types.Context, x: float, y: float) -> None:
    """Take note of the pointer's place in the editor's main region; redraws where something else is under it now."""
    before = _hover.get("thing")
    thing = strip_layout.find_at(context, context.region, x, y)
    _hover.update(region=context.region.as_pointer(), place=(x, y), time=time.monotonic(), thing=thing)
    if (before is None) != (thing is None) or (thing is not None and _identify(before) != _identify(thing)):
        context.area.tag_redraw()
    if thing is not None:
        call_soon(_end_hover, HOVER_SECONDS)


def _identify(thing: DrawnName | DrawnStrip | None) -> tuple | None:
    return thing and (type(thing), thing.target, thing.strip, getattr(thing, "index", -1))


def _end_hover() -> float | None:
    """Stop showing what was under the pointer once it has rested, or has left the editor."""
    wait = HOVER_SECONDS - (time.monotonic() - _hover.get("time", 0.0))
    if wait > 0.1:
        return wait
    _hover.clear()
    names.redraw_editors()
    return None


def _draw() -> None:
    context = bpy.context
    if not names.is_visible(context):
        return
    region, canvas = context.region, Canvas()
    if context.area.type == "NLA_EDITOR":
        strip_layout.update_rows(context, region)
    layout = strip_layout.build_layout(context, region)
    look = Look(context)
    _add_lanes(canvas, layout, look)
    if is_running(DRAGGING):
        _cover_dragged(canvas, layout, look)
    for strip in layout.strips:
        _add_strip(canvas, strip, look)
    for name in layout.names:
        _add_moment(canvas, name, look)
    _add_foot(canvas, context, layout, look)
    canvas.draw()
    note = Canvas()  # over all texts
    _add_note(note, context, layout, look)
    note.draw()


class Look:
    """What all parts of a draw need: the scale, the editor's size and its theme."""

    def __init__(self, context: bpy.types.Context):
        theme = context.preferences.themes[0].nla_editor
        self.scale = context.preferences.system.ui_scale
        self.width, self.height = context.region.width, context.region.height - names.TOP * self.scale
        self.shift, self.per_frame = names.find_frame_pixels(context.region)
        self.back = tuple(theme.space.back)[:3]
        self.ink = groups.choose_ink(self.back)
        self.selected = tuple(theme.strips_selected)[:3]

    def compute_baseline(self, bottom: float, top: float, size: float) -> float:
        """Compute the baseline of letters in the middle between two heights."""
        return round(0.5 * (bottom + top) - 0.35 * size)


def _add_lanes(canvas: Canvas, layout: Layout, look: Look) -> None:
    """Cover the rows of the dots' own keys with a calm bar."""
    for target, (left, bottom, right, top) in layout.lanes:
        top = min(top, look.height)
        canvas.add_box((left, bottom, right, top), groups.mix(look.back, look.ink, 0.07))
        size = SMALL * look.scale
        text, first = timeline_texts.describe_track(target)
        if top - bottom > size:
            x = min(max(look.shift + look.per_frame * first, 0.0), look.width) + names.PAD * look.scale
            canvas.add_text((x, look.compute_baseline(bottom, top, size)), text, size, look.ink, 0.55)


def _cover_dragged(canvas: Canvas, layout: Layout, look: Look) -> None:
    """Cover what Blender draws beside strips while they are dragged: it holds them to both ends of their row."""
    for bottom, top in {(strip.box[1], strip.box[3]) for strip in layout.strips if strip.is_selected}:
        canvas.add_box((0.0, bottom, look.width, min(top, look.height)), groups.mix(look.back, look.ink, 0.03))


def _add_strip(canvas: Canvas, strip: DrawnStrip, look: Look) -> None:
    """Add a strip's body over Blender's, within its outline, and its labels."""
    left, bottom, right, top = strip.box
    box = (max(left + 1, 0.0), bottom + 1, min(right - 1, look.width), min(top - 1, look.height))
    if box[3] <= box[1]:
        return
    dim = strip.is_muted or strip.kind == "automatic"
    is_lane = strip.kind == "moments"
    colour = strip.colour
    paper = groups.mix(look.back, look.ink, 0.14) if is_lane else groups.mix(look.back, colour, 0.4) if dim else colour
    canvas.add_box(box, paper)
    if dim and not is_lane:
        canvas.add_box((box[0], box[1], min(box[0] + 3 * look.scale, box[2]), box[3]), colour)
    if strip.is_selected and not is_lane:
        canvas.add_frame(box, EDGE * look.scale + 1, groups.choose_ink(paper))
    if strip.is_selected:
        canvas.add_frame(box, EDGE * look.scale, look.selected)
    if not is_lane:
        size, pad = names.TEXT * look.scale, (names.PAD + 2 * dim) * look.scale
        room = box[2] - box[0] - 2 * pad
        text = groups.elide(strip.name, room, lambda part: names.measure(part, size)) if room > size else ""
        canvas.add_text((box[0] + pad, look.compute_baseline(box[1], box[3], size)), text, size,
                        groups.choose_ink(paper), 0.8 if dim else 1.0)


def _add_moment(canvas: Canvas, name: DrawnName, look: Look) -> None:
    """Add a key moment: its diamond and the name beside it, or its name at the foot with a line up to it."""
    size, colour = names.TEXT * look.scale, name.colour
    alpha = 0.5 if name.is_muted else 1.0
    if name.is_at_foot:
        left, bottom, right, top = name.box
        reached = look.height if name.y is None else name.y - names.DIAMOND * look.scale
        canvas.add_box((name.x - 0.5 * look.scale, top, name.x + 0.5 * look.scale, reached), colour, 0.35 * alpha)
        if name.is_selected:
            canvas.add_box((left - EDGE, bottom - EDGE, right + EDGE, top + EDGE), look.selected)
        canvas.add_box(name.box, PAPER)
        canvas.add_box((left, bottom, left + 3 * look.scale, top), colour, alpha)
        canvas.add_text((left + names.PAD * look.scale, look.compute_baseline(bottom, top, size)), name.text, size,
                        (1.0, 0.6, 0.5) if name.has_problem else INK, alpha)
    elif name.y is not None and name.box[3] < look.height:
        half = names.DIAMOND * look.scale
        canvas.add_diamond(name.x, name.y, half + (3.0 if name.is_selected else 1.5) * look.scale,
                           look.selected if name.is_selected else (0.9, 0.1, 0.1) if name.has_problem else PAPER)
        canvas.add_diamond(name.x, name.y, half, groups.mix(look.back, colour, alpha))
        small = SMALL * look.scale
        canvas.add_text((name.x - 0.5 * names.measure(name.letter, small), round(name.y - 0.36 * small)), name.letter,
                        small, groups.choose_ink(groups.mix(look.back, colour, alpha)))
        canvas.add_text((name.box[0] + (2 * names.DIAMOND + names.GAP) * look.scale, round(name.y - 0.35 * size)),
                        name.text, size, look.ink, alpha)


def _add_foot(canvas: Canvas, context, layout: Layout, look: Look) -> None:
    """Add the legend of the colours in view at the right, and the keys at the left as far as there is room."""
    size, scale = SMALL * look.scale, look.scale
    baseline, x = FOOT * scale + 4 * scale, look.width - 18 * scale
    for group in reversed(_list_groups(layout)):
        width = names.measure(group.title, size) + 26 * scale
        if x - width < 0:
            break
        x -= width
        canvas.add_diamond(x + 7 * scale, baseline + 0.35 * size, 5.5 * scale, group.colour)
        canvas.add_text((x + 15 * scale, baseline), group.title, size, look.ink, 0.75)
    hints = timeline_texts.list_keys(context.area.type)
    while hints and names.measure("    ".join(hints), size) > x - 24 * scale:
        hints = hints[:-1]
    canvas.add_text((8 * scale, baseline), "    ".join(hints), size, look.ink, 0.6)


def _list_groups(layout: Layout) -> list[LabelGroup]:
    """List the groups in view, in the order of the legend."""
    seen = {one.group for one in layout.names} | {one.group for one in layout.strips if one.kind != "moments"}
    return [group for group in groups.GROUPS if group in seen and group is not groups.AUTOMATIC]


def _add_note(canvas: Canvas, context, layout: Layout, look: Look) -> None:
    """Add the box that tells what is being dragged, else what is under the pointer."""
    if is_running(DRAGGING):
        lines, place = timeline_texts.describe_drag(context, layout)
        if lines:
            _add_lines(canvas, lines, place, look)
    elif _hover.get("region") == context.region.as_pointer() and _hover.get("thing") is not None:
        thing = strip_layout.find_at(context, context.region, *_hover["place"])
        if thing is not None:
            x, y = _hover["place"]
            _add_lines(canvas, timeline_texts.describe_thing(context, thing), (x + 14 * look.scale, y), look)


def _add_lines(canvas: Canvas, lines: list[str], place: tuple[float, float], look: Look) -> None:
    """Add lines of text in a dark box above a place, within the editor."""
    size, pad = names.TEXT * look.scale, 6 * look.scale
    width = max(names.measure(line, size) for line in lines) + 2 * pad
    height = len(lines) * 1.45 * size + 2 * pad
    left = max(min(place[0], look.width - width - 20 * look.scale), 2.0)
    bottom = place[1] + 14 * look.scale
    bottom = bottom if bottom + height < look.height else max(place[1] - height - 14 * look.scale, 2.0)
    canvas.add_box((left - 1, bottom - 1, left + width + 1, bottom + height + 1), groups.mix(PAPER, INK, 0.35))
    canvas.add_box((left, bottom, left + width, bottom + height), PAPER)
    for number, line in enumerate(lines):
        canvas.add_text((left + pad, bottom + height - pad - (1.45 * number + 1.05) * size), line, size, INK,
                        1.0 if number == 0 else 0.75)


def _forget() -> None:
    """Forget what belongs to windows that are gone."""
    strip_layout.forget_rows()
    timeline_texts.forget_keys()
    _hover.clear()


WATCHER = Watcher(
    name="Labels of the timeline", loaded=_forget, ends=_forget,
    draws=tuple((space, draw, "POST_PIXEL") for space in (bpy.types.SpaceNLA, bpy.types.SpaceDopeSheetEditor)),
)
