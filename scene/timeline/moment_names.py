"""Key moments in the NLA editor and the dope sheet: a diamond on their track with the name beside it, where Blender
draws only ticks. Names without room there, or without a row, stand at the foot of the editor: the active player's, and
those of other selected objects where no rows are in view.

The same layout serves for drawing and for finding what was clicked.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import bpy

from ..core import window
from . import label_tracks as lanes
from . import strips
from .label_groups import Colour, LabelGroup, elide, find_colour, find_group_of_name, find_part_letter, split_labels

TEXT, ROW, PAD, GAP = 11, 18, 5, 4  # points: letters, height of a row, around the text, between two names
BOTTOM, TOP = 44, 26  # points left free for scroll bar, keys and legend, and for the frame numbers
MOST_ROWS = 5
DIAMOND = 8.5  # points from the middle of a diamond to its corners
LEAST_NAME = 34  # points: a name on a track is cut to no less, else it stands at the foot


@dataclass(frozen=True, kw_only=True)
class DrawnName:
    """A drawn key moment.

    Attributes:
        text: the name as drawn; may be cut, or empty.
        name: the whole name.
        target: name of the object.
        strip: name of the strip.
        index: of the marker.
        frame: scene frame.
        x: pixels, of the marker.
        y: pixels, of the middle of its track; None where its row is not known.
        box: left, bottom, right, top, pixels of the region.
        is_selected: whether the moment is selected.
        is_muted: whether its strip is muted.
        has_problem: whether its labels have a problem.
        is_at_foot: whether the name stands at the foot of the editor.
    """

    text: str
    name: str
    target: str
    strip: str
    index: int
    frame: int
    x: float
    y: float | None
    box: tuple[float, float, float, float]
    is_selected: bool
    is_muted: bool
    has_problem: bool
    is_at_foot: bool = False

    @property
    def group(self) -> LabelGroup:
        """The kind of action."""
        return find_group_of_name(self.name)

    @property
    def colour(self) -> Colour:
        """The colour of its action."""
        return find_colour(self.name)

    @property
    def letter(self) -> str:
        """The letter of its diamond."""
        return find_part_letter(split_labels(self.name))


@lru_cache(maxsize=4096)
def measure(text: str, size: float) -> float:
    """Measure the width of a text in pixels; size: of the letters, in pixels."""
    import blf

    blf.size(0, size)
    return blf.dimensions(0, text)[0]


def list_names(context: bpy.types.Context, region: bpy.types.Region, middles: dict[tuple[str, str], float]
               ) -> list[DrawnName]:
    """Compute all key moments to draw in a region, names without overlaps; a selected one always has a place.

    Args:
        context: of the editor.
        region: its main region.
        middles: the pixels of the middle of each known row, by the names of object and NLA track.
    Returns:
        Those on tracks from left to right, then those at the foot.
    """
    scale = context.preferences.system.ui_scale
    scene_names = _list_placed(context, region, middles)
    on_tracks = _place_on_tracks([one for one in scene_names if one.y is not None], region.width, scale)
    shown = {target.name for target in list_shown_targets(context)}
    if middles and (active := strips.find_target(context)) is not None:
        shown = {active.name}  # of others they would stand over the rows
    rest = [one for one in on_tracks if not one.text] + [one for one in scene_names if one.y is None]
    return on_tracks + _place_at_foot([one for one in rest if one.target in shown], region, scale)


def list_shown_targets(context: bpy.types.Context) -> list[bpy.types.Object]:
    """List the objects whose names may stand at the foot: the active player's dot and, without any rows, selected ones.
    """
    chosen = {target.name: target for target in context.selected_objects if lanes.has_label_tracks(target)}
    active = strips.find_target(context)
    if active is not None:
        chosen[active.name] = active
    return list(chosen.values())


def _list_placed(context, region, middles) -> list[DrawnName]:
    """List all key moments in view by frame, with the box of their diamond and without text."""
    known = {target for target, _ in middles}
    targets = {target.name: target for target in list_shown_targets(context)}
    targets.update((name, context.scene.objects[name]) for name in known if name in context.scene.objects)
    problems = {(one.target, one.frame) for one in context.window_manager.beyond_mocap_problems.lines}
    half = DIAMOND * context.preferences.system.ui_scale
    shift, per_frame = find_frame_pixels(region)
    found = []
    for target in targets.values():
        for frame, track, strip, index, marker, is_muted in iter_markers(target):
            x, y = shift + per_frame * frame, middles.get((target.name, track.name))
            if -half <= x < region.width + half:
                box = (x - half, (y or 0.0) - half, x + half, (y or 0.0) + half)
                found.append(DrawnName(text="", name=marker.name or "?", target=target.name, strip=strip.name,
                                       index=index, frame=frame, x=x, y=y, box=box, is_selected=marker.select,
                                       is_muted=is_muted, has_problem=(target.name, frame) in problems))
    return sorted(found, key=lambda one: (one.frame, one.target, one.index))


def find_frame_pixels(region: bpy.types.Region) -> tuple[float, float]:
    """Find the pixel of frame 0 and the pixels of a frame, both exact."""
    low, high = region.view2d.region_to_view(0, 0)[0], region.view2d.region_to_view(region.width, 0)[0]
    per_frame = region.width / max(high - low, 1e-6)
    return -low * per_frame, per_frame


def iter_markers(target: bpy.types.Object) -> Iterator[tuple]:
    """Iterate over (scene frame, NLA track, strip, index, marker, is muted) of an object's key moments.

    Names are not parsed, since drawing has no time for it.
    """
    for track, strip in lanes.iter_strips(target):
        for index, marker in enumerate(strip.action.pose_markers):
            if lanes.is_marker_visible(strip, marker):
                yield (lanes.compute_marker_frame(strip, marker), track, strip, index, marker,
                       track.mute or strip.mute)


def _place_on_tracks(moments: list[DrawnName], width: float, scale: float) -> list[DrawnName]:
    """Give each name the room up to the next diamond of its track, where at least some letters of it fit."""
    size, placed, limit = TEXT * scale, [], {}
    for one in reversed(moments):
        room = limit.get((one.target, one.y), width) - one.box[2] - 2 * GAP * scale
        text = elide(one.name, room, lambda part: measure(part, size)) if room >= LEAST_NAME * scale else ""
        right = one.box[2] + (GAP * scale + measure(text, size) if text else 0.0)
        placed.append(replace(one, text=text, box=(*one.box[:2], right, one.box[3])))
        limit[(one.target, one.y)] = one.box[0]
    return placed[::-1]


def _place_at_foot(moments: list[DrawnName], region, scale: float) -> list[DrawnName]:
    """Place names in rows at the foot of the editor, selected ones first; those without room are left out."""
    rows: list[list[tuple[float, float]]] = [[] for _ in range(_count_rows(region, scale))]
    whose = len({one.target for one in moments}) > 1
    found = []
    for one in sorted(moments, key=lambda one: (not one.is_selected, one.frame)):
        text = f"{_find_owner(one.target)}: {one.name}" if whose else one.name
        width = measure(text, TEXT * scale) + 2 * PAD * scale
        if not 0 <= one.x < region.width or width > region.width - 2 * GAP * scale:
            continue
        left = min(max(one.x - PAD * scale, GAP * scale), region.width - width - GAP * scale)
        row = next((n for n, held in enumerate(rows) if all(left > b or left + width < a for a, b in held)), None)
        if row is None:
            continue
        rows[row].append((left - GAP * scale, left + width + GAP * scale))
        bottom = (BOTTOM + row * ROW) * scale
        box = (left, bottom, left + width, bottom + (ROW - 2) * scale)
        found.append(replace(one, text=text, box=box, is_at_foot=True))
    return found


def _find_owner(target: str) -> str:
    thing = bpy.context.scene.objects.get(target)
    return (thing.beyond_mocap_dot.player if thing is not None else "") or target


def _count_rows(region: bpy.types.Region, scale: float) -> int:
    """Count the rows of names that fit into the lower half of a region."""
    return max(1, min(MOST_ROWS, int((0.5 * region.height - BOTTOM * scale) / (ROW * scale))))


def is_visible(context: bpy.types.Context) -> bool:
    """Return whether labels are switched on and this editor has room for them."""
    space = context.space_data
    tiny = getattr(space, "mode", "") == "TIMELINE" or context.region is None or context.region.height < 90
    return context.scene.beyond_mocap.show_moment_names and not tiny


def redraw_editors() -> None:
    """Redraw the editors that show names."""
    window.redraw_editors("NLA_EDITOR", "DOPESHEET_EDITOR")
