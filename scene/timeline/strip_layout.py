"""Where the strips of all timelines are drawn in an NLA editor, and what lies under the pointer.

The rows are found again whenever the editor is drawn; in between, clicks and the pointer are answered from the last
ones.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import bpy
import numpy as np

from . import label_tracks as lanes
from . import nla_rows
from .label_groups import Colour, LabelGroup, find_colour, find_group_of_name
from .moment_names import DrawnName, find_frame_pixels, is_visible, list_names
from .strip_lines import remove_name_suffix

OWN = ""  # in place of a track's name: the row of an object's own keys
PLAYING_SECONDS = 0.5  # between two looks at the rows while the animation plays

_rows: dict[int, dict[tuple[str, str], int]] = {}  # region -> (object, NLA track) -> row, as last drawn
_looked: dict[int, float] = {}  # region -> when its rows were found


@dataclass(frozen=True, kw_only=True)
class DrawnStrip:
    """A strip in place.

    Attributes:
        target: name of the object.
        strip: name of the strip.
        kind: "span", "automatic" or "moments".
        name: its labels.
        first, last: scene frames.
        box: left, bottom, right, top, pixels of the region; may reach beyond it.
        is_selected: whether it is selected.
        is_muted: whether it or its track is muted.
    """

    target: str
    strip: str
    kind: str
    name: str
    first: float
    last: float
    box: tuple[float, float, float, float]
    is_selected: bool
    is_muted: bool

    @property
    def group(self) -> LabelGroup:
        """The kind of action."""
        return find_group_of_name(self.name)

    @property
    def colour(self) -> Colour:
        """The colour of its action."""
        return find_colour(self.name)


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Everything that is drawn over one NLA editor or dope sheet.

    Attributes:
        strips: of all timelines.
        names: key moments.
        lanes: (name of the object, box) of the rows of the objects' own keys.
    """

    strips: tuple[DrawnStrip, ...] = ()
    names: tuple[DrawnName, ...] = ()
    lanes: tuple[tuple[str, tuple[float, float, float, float]], ...] = ()


def build_layout(context: bpy.types.Context, region: bpy.types.Region) -> Layout:
    """Build the layout of an editor from the rows that were found when it was last drawn."""
    rows = _rows.get(region.as_pointer(), {}) if context.area.type == "NLA_EDITOR" else {}
    rows = {key: row for key, row in rows.items() if key[0] in context.scene.objects}
    grid, heights = _build_grid(context), _find_height_pixels(region)
    spans = {key: _compute_pixels(heights, grid, row) for key, row in rows.items()}
    middles = {key: 0.5 * (low + high) for key, (low, high) in spans.items()}
    return Layout(strips=tuple(_list_strips(context, region, spans)),
                  names=tuple(list_names(context, region, middles)), lanes=tuple(_list_lanes(context, region, rows)))


def find_name_at(context: bpy.types.Context, region: bpy.types.Region, x: float, y: float) -> DrawnName | None:
    """Find the key moment at a place of the region in pixels: its diamond or name."""
    if not is_visible(context):
        return None
    return next((one for one in reversed(build_layout(context, region).names) if _is_inside(one.box, x, y)), None)


def find_at(context: bpy.types.Context, region: bpy.types.Region, x: float, y: float) -> DrawnName | DrawnStrip | None:
    """Find the key moment or strip at a place of the region in pixels."""
    if not is_visible(context):
        return None
    layout = build_layout(context, region)
    spans = [one for one in layout.strips if one.kind != "moments"]
    return next((one for one in (*reversed(layout.names), *spans) if _is_inside(one.box, x, y)), None)


def update_rows(context: bpy.types.Context, region: bpy.types.Region) -> None:
    """Find the rows of all timelines in what Blender has just drawn in this NLA editor; now and then while it plays."""
    waited = time.monotonic() - _looked.get(region.as_pointer(), 0.0)
    if context.screen.is_animation_playing and waited < PLAYING_SECONDS:
        return
    _looked[region.as_pointer()] = time.monotonic()
    targets = _list_targets(context)
    blocks = [(target, tracks) for target in targets for tracks in _list_blocks(context, target)]
    lines, known = _read_lines(context, region)
    patterns = [[_build_pattern(context, region, track) for track in tracks] for _, tracks in blocks]
    found = nla_rows.find_rows(patterns, lines, known, _find_limits(context, region))
    rows = {(target.name, track.name): row + number for (target, tracks), row in zip(blocks, found)
            if row is not None for number, track in enumerate(tracks)}
    bands = nla_rows.find_bands(lines, known, tuple(context.preferences.themes[0].nla_editor.active_action))
    _rows[region.as_pointer()] = {**rows, **_find_own_rows(context, rows, bands)}


def forget_rows() -> None:
    """Forget all rows."""
    _rows.clear()
    _looked.clear()


def _find_own_rows(context, rows: dict[tuple[str, str], int], bands: list[int]) -> dict[tuple[str, str], int]:
    """Find the rows of the dots' own keys: in the order of the tinted rows where each has its object, else just above
    the topmost track.
    """
    players = [target for target in _list_targets(context) if target.beyond_mocap_dot.player]
    above = {(target.name, OWN): row - 1 for target in players if target.animation_data.action is not None
             if (row := rows.get((target.name, target.animation_data.nla_tracks[-1].name)))}
    owners = [thing for thing in _list_shown(context) if thing.animation_data and thing.animation_data.action]
    bands = [row for row in bands if row not in rows.values()]
    if len(owners) != len(bands):
        return above
    tinted = {(thing.name, OWN): row for thing, row in zip(owners, bands) if thing.beyond_mocap_dot.clock}
    return tinted if above.items() <= tinted.items() else above


def _list_targets(context: bpy.types.Context) -> list[bpy.types.Object]:
    """List the objects with label tracks that the editor may show, in its order."""
    return [target for target in _list_shown(context) if lanes.has_label_tracks(target)]


def _list_shown(context: bpy.types.Context) -> list[bpy.types.Object]:
    """List the objects that the editor may show, in its order."""
    sheet, objects = context.space_data.dopesheet, context.view_layer.objects
    found = [target for target in objects if target.animation_data is not None
             and (target.select_get() or not sheet.show_only_selected)
             and (sheet.show_hidden or target.visible_get())]
    return sorted(found, key=lambda target: target.name.encode()) if sheet.use_datablock_sort else found


def _list_blocks(context, target: bpy.types.Object) -> list[list[bpy.types.NlaTrack]]:
    """List the tracks that stand together, from top to bottom: all, or each alone where a text filter may hide some."""
    tracks = list(target.animation_data.nla_tracks)[::-1]
    return [[track] for track in tracks] if context.space_data.dopesheet.filter_text else [tracks]


def _build_grid(context: bpy.types.Context) -> nla_rows.RowGrid:
    system = context.preferences.system
    return nla_rows.build_grid(system.ui_scale, system.pixel_size,
                               getattr(context.space_data, "show_strip_curves", True))


def _find_height_pixels(region: bpy.types.Region) -> tuple[float, float]:
    """Find the view's height at the lower edge of the region, and the pixels of a unit."""
    zero = region.view2d.region_to_view(0, 0)[1]
    return zero, region.height / max(region.view2d.region_to_view(0, region.height)[1] - zero, 1e-6)


def _compute_pixels(heights: tuple[float, float], grid: nla_rows.RowGrid, row: int) -> tuple[float, float]:
    """Compute bottom and top of a row in pixels of the region."""
    zero, per_unit = heights
    return tuple((y - zero) * per_unit for y in grid.compute_span(row))


def _read_lines(context, region) -> tuple[np.ndarray, np.ndarray]:
    """Read two lines of pixels (R, 2, W, 3) of each row of the grid, and whether both are in view (R,)."""
    import gpu

    grid, picture = _build_grid(context), gpu.state.active_framebuffer_get()
    heights = _find_height_pixels(region)
    count = max(1, int((grid.top - heights[0]) / grid.step) + 1)
    lines, known = np.zeros((count, 2, region.width, 3), np.uint8), np.zeros(count, bool)
    for row in range(count):
        low, high = _compute_pixels(heights, grid, row)
        inset = max(2.0, nla_rows.LOOK_AT * (high - low))
        known[row] = low + inset >= 0 and high - inset < region.height - 24 * context.preferences.system.ui_scale
        if known[row]:
            for number, y in enumerate((low + inset, high - inset)):
                pixels = picture.read_color(0, int(y), *(region.width, 1, 4, 0), "UBYTE")
                lines[row, number] = np.array(pixels, copy=False).reshape(region.width, 4)[:, :3]
    return lines, known


def _build_pattern(context, region, track: bpy.types.NlaTrack) -> nla_rows.TrackPattern:
    theme = context.preferences.themes[0].nla_editor
    shift, per_frame = find_frame_pixels(region)
    strips, colours = [], []
    for strip in track.strips:
        kind = {"CLIP": "strips", "META": "meta_strips", "TRANSITION": "transition_strips",
                "SOUND": "sound_strips"}[strip.type]
        colour = getattr(theme, f"{kind}_selected" if strip.select else kind)
        strips.append((shift + per_frame * strip.frame_start, shift + per_frame * strip.frame_end))
        colours.append(tuple(int(255 * part + 0.5) for part in colour))
    return nla_rows.TrackPattern(tuple(strips), tuple(colours))


def _find_limits(context, region) -> tuple[float, float]:
    """Find the pixels between which Blender does not shade what it draws."""
    scene, (shift, per_frame) = context.scene, find_frame_pixels(region)
    if not scene.use_preview_range:
        return 0.0, float(region.width)
    left, right = (shift + per_frame * frame for frame in (scene.frame_preview_start, scene.frame_preview_end))
    return min(max(left, 0.0), region.width - 1.0), min(max(right, 1.0), float(region.width))


def _list_strips(context, region, spans) -> list[DrawnStrip]:
    """List the strips of known rows that are in view."""
    shift, per_frame = find_frame_pixels(region)
    found = []
    for target in {name: context.scene.objects[name] for name, _ in spans}.values():
        for track, strip in lanes.iter_strips(target):
            low, high = spans.get((target.name, track.name), (0.0, -1.0))
            first, last = strip.frame_start, strip.frame_end
            left, right = shift + per_frame * first, shift + per_frame * last
            if right >= 0 and left <= region.width and high >= 0 and low <= region.height:
                name = strip.name
                found.append(DrawnStrip(target=target.name, strip=name, kind=strip.action.beyond_mocap.kind,
                                        name=remove_name_suffix(name), first=first, last=last,
                                        box=(left, low, right, high), is_selected=strip.select,
                                        is_muted=track.mute or strip.mute))
    return found


def _list_lanes(context, region, rows) -> list[tuple[str, tuple[float, float, float, float]]]:
    """List the rows of the dots' own keys; Blender draws them a little higher than others."""
    grid, heights, found = _build_grid(context), _find_height_pixels(region), []
    for name, row in [(name, row) for (name, track), row in rows.items() if track == OWN]:
        low, high = _compute_pixels(heights, grid, row)
        found.append((name, (0.0, low, float(region.width), high + grid.skip * (high - low) / grid.height)))
    return found


def _is_inside(box, x: float, y: float) -> bool:
    return box[0] <= x <= box[2] and box[1] <= y <= box[3]
