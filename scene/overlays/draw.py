"""The handlers of the 3D view: they draw cached batches of what `prepare` built, with texts and the legend.

Depth is tested with a small bias towards the eye, since overlays on the ground coincide with the pitch's lines, and far
away the depth buffer cannot resolve centimetres.
"""

from __future__ import annotations

from typing import NamedTuple

import blf
import bpy
import gpu
from bpy_extras.view3d_utils import location_3d_to_region_2d
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix, Vector

from ..core import window
from ..core.live import Watcher
from ..core.settings import find_active_player
from . import ball_paths, colours, contact_handles, momentum, path_overlays, prepare, shapes, store, text_places

BIAS = 1e-5
DISC, LIFT = 0.12, 0.034  # metres: radius of a contact's disc, its height above the ground
MOST_LABELS = 12
SIZE, MARGIN, LINE = 11, 5, 1.4  # points, points, sizes
SWATCH = 150  # points: length of a colour scale
FONT = 0
GROUND = (0.03, 0.03, 0.03, 0.72)  # background of texts

_batches: dict[tuple, list] = {}
_owners: dict[str, prepare.PreparedTake] = {}
_square: list = []
_taken: list[text_places.Box] = []  # places of the texts that this draw has drawn so far


class DrawnTake(NamedTuple):
    """One player as drawn.

    Attributes:
        take: name of the take.
        prepared: its meshes and texts.
        world: matrix from the take's metres to the scene.
        seconds: the present time on the take's clock.
        active: whether the player is active.
    """

    take: str
    prepared: prepare.PreparedTake
    world: Matrix
    seconds: float
    active: bool


def clear_batches() -> None:
    """Free all cached batches."""
    _batches.clear()
    _owners.clear()
    _square.clear()


def measure_lines(lines, scale: float) -> tuple[float, float]:
    """Measure the background of lines of text: width and height in pixels."""
    blf.size(FONT, SIZE * scale)
    blf.enable(FONT, blf.WORD_WRAP)  # also breaks at line ends, so that one call measures and draws all lines
    blf.word_wrap(FONT, 10000)
    width, height = blf.dimensions(FONT, "\n".join(lines))
    blf.disable(FONT, blf.WORD_WRAP)
    return width + 2 * MARGIN * scale, height + 2.4 * MARGIN * scale


def draw_lines(x: float, y: float, lines, scale: float, strength: float = 1.0) -> None:
    """Draw lines of text, the first on top, on a dark background whose lower left corner is at pixel x, y."""
    size, margin, text = SIZE * scale, MARGIN * scale, "\n".join(lines)
    width, height = measure_lines(lines, scale)
    width, height = width - 2 * margin, height - 2.4 * margin
    blf.enable(FONT, blf.WORD_WRAP)
    blf.word_wrap(FONT, 10000)
    draw_box(x, y, width + 2 * margin, height + 2.4 * margin, (*GROUND[:3], GROUND[3] * strength))
    blf.color(FONT, 1.0, 1.0, 1.0, strength)
    blf.position(FONT, x + margin, y + margin + height - 0.78 * size, 0.0)
    blf.draw(FONT, text)
    blf.disable(FONT, blf.WORD_WRAP)


def draw_box(x: float, y: float, width: float, height: float, colour) -> None:
    """Draw a filled rectangle in pixels."""
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    if not _square:
        _square.append(batch_for_shader(shader, "TRIS", {"pos": [(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)]}))
    with gpu.matrix.push_pop():
        gpu.matrix.translate((x, y))
        gpu.matrix.scale((width, height))
        shader.bind()
        shader.uniform_float("color", colour)
        _square[0].draw(shader)


def draw_legend(context, on: list[str]) -> None:
    """Draw the legend in the lower left corner of the view, with a row for each overlay that needs one."""
    rows = [row for name, row in ROWS.items() if name in on]
    if not rows:
        return
    scale = context.preferences.system.ui_scale
    left, bottom, _, _ = window.find_free_region(context.area, context.region)
    x, y = left + 8 * scale, bottom + 8 * scale
    for row in reversed(rows):
        y += row(x, y, scale) + 4 * scale


def _list_takes(context) -> list[DrawnTake]:
    """List the takes to draw in this view; [] if overlays are off or nothing is prepared."""
    settings = getattr(context.scene, "beyond_mocap", None)
    space = context.space_data
    if settings is None or not settings.view.list_overlays() or not space.overlay.show_overlays:
        return []
    active, seconds = find_active_player(settings), store.seconds_at(context.scene)
    found = []
    for player in store.list_shown_players(settings):
        prepared = store.find_prepared(player.take)
        if prepared is not None:
            world = store.take_to_world(context.scene, player.body)
            found.append(DrawnTake(player.take, prepared, world, seconds, player == active))
    _free_unused({shown.take: shown.prepared for shown in found})
    return found


def _free_unused(now: dict[str, prepare.PreparedTake]) -> None:
    """Free the batches of takes that are no longer drawn."""
    unused = {take for take, owner in _owners.items() if store.find_prepared(take) is not owner}
    for key in [key for key in _batches if key[0] in unused]:
        del _batches[key]
    for take in unused:
        del _owners[take]
    _owners.update(now)


def _list_path_items(context) -> list[path_overlays.DrawItem]:
    """List the overlays of paths, balls and momentum of this view, and free the batches of those no longer drawn."""
    items = []
    if context.space_data.overlay.show_overlays and getattr(context.scene, "beyond_mocap", None) is not None:
        items = [*path_overlays.list_items(context.scene), *ball_paths.list_items(context.scene),
                 *momentum.list_items(context.scene), *contact_handles.list_items(context.scene)]
    now = {item.key for item in items}
    for key in [key for key in _batches if not isinstance(key[0], str) and key not in now]:
        del _batches[key]
    return items


def _draw_shapes():
    """Draw all shapes of the view: overlays of takes, then those of paths, balls and momentum."""
    context = bpy.context
    found, path_items = _list_takes(context), _list_path_items(context)
    if not found and not path_items:
        return
    view = context.scene.beyond_mocap.view
    with gpu.matrix.push_pop_projection():
        projection = gpu.matrix.get_projection_matrix()
        projection[2] -= BIAS * projection[3]
        gpu.matrix.load_projection_matrix(projection)
        gpu.state.blend_set("ALPHA")
        _set_depth_test(view.in_front)
        gpu.state.depth_mask_set(False)
        try:
            for drawn in found:
                with gpu.matrix.push_pop():
                    gpu.matrix.multiply_matrix(drawn.world)
                    for name in view.list_overlays():
                        _draw_overlay(context, view, name, drawn)
            for item in path_items:
                _set_depth_test(view.in_front or item.in_front)
                with gpu.matrix.push_pop():
                    gpu.matrix.multiply_matrix(item.world)
                    _draw_batches(context, _build_batches(item.key, item.meshes))
        finally:
            gpu.state.depth_mask_set(True)
            gpu.state.depth_test_set("NONE")
            gpu.state.blend_set("NONE")


def _set_depth_test(in_front: bool) -> None:
    gpu.state.depth_test_set("NONE" if in_front else "LESS_EQUAL")


def _draw_overlay(context, view, name: str, shown: DrawnTake) -> None:
    if name == "contacts":
        _draw_contacts(shown)
    elif name == "heading" and not shown.active:
        return
    elif name == "ghosts":
        for frame in _ghost_frames(view, shown):
            _draw_batches(context, _build_batches((shown.take, "ghost", frame),
                                                  lambda: [_build_figure(shown.prepared, frame)]))
    else:
        _draw_batches(context, _build_batches((shown.take, name), lambda: shown.prepared.meshes.get(name, ())))


def _ghost_frames(view, shown: DrawnTake) -> list[int]:
    """List the frames of the figures near the playhead, without that of the body itself."""
    prepared = shown.prepared
    first, now, last = (prepared.find_frame(shown.seconds + side * view.reach) for side in (-1, 0, 1))
    if view.ghosts_at == "SEAMS":
        return [frame for frame in prepared.transitions if first <= frame <= last]
    step = max(1, round(view.ghost_step * prepared.fps))
    return [frame for frame in range(-(-first // step) * step, last + 1, step) if frame != now]


def _build_figure(prepared: prepare.PreparedTake, frame: int) -> prepare.Mesh:
    points = prepared.figures[frame][prepared.pairs].reshape(-1, 3)
    return prepare.Mesh("LINES", points, prepared.pair_colours, 2.0)


def _build_batches(key: tuple, meshes) -> list:
    """Build the batches of one overlay when it is first drawn."""
    if key not in _batches:
        _batches[key] = [
            (batch_for_shader(_find_shader(mesh.kind), mesh.kind, {"pos": mesh.points, "color": mesh.colours}), mesh)
            for mesh in meshes()
        ]
    return _batches[key]


def _find_shader(kind: str):
    return gpu.shader.from_builtin("POLYLINE_FLAT_COLOR" if kind == "LINES" else "SMOOTH_COLOR")


def _draw_batches(context, batches) -> None:
    for batch, mesh in batches:
        shader = _find_shader(mesh.kind)
        shader.bind()
        if mesh.kind == "LINES":
            shader.uniform_float("viewportSize", (context.region.width, context.region.height))
            shader.uniform_float("lineWidth", mesh.width * context.preferences.system.ui_scale)
        batch.draw(shader)


def _draw_contacts(shown: DrawnTake) -> None:
    """Draw a disc under each foot in contact."""
    prepared, frame = shown.prepared, shown.prepared.find_frame(shown.seconds)
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    for side, rgb in enumerate((colours.LEFT, colours.RIGHT)):
        if prepared.contacts[frame, side]:
            x, y, _ = prepared.toes[frame, side].tolist()
            with gpu.matrix.push_pop():
                gpu.matrix.translate((x, y, LIFT))
                shader.bind()
                shader.uniform_float("color", (*rgb, 0.75))
                _build_batches(("", "disc"), _build_disc)[0][0].draw(shader)


def _build_disc() -> list[prepare.Mesh]:
    points = shapes.build_disc(DISC)
    return [prepare.Mesh("TRIS", points, colours.repeat_colour(colours.WHITE, len(points)))]


def _draw_texts():
    """Draw all texts of the view and the legend."""
    context = bpy.context
    found, over = _list_takes(context), context.space_data.overlay.show_overlays
    has_paths, has_balls = over and path_overlays.list_visible_edits(context.scene), over and ball_paths.has_items(
        context.scene)
    labels = momentum.list_labels(context.scene) if over else []
    if not found and not has_paths and not has_balls and not labels:
        return
    view = context.scene.beyond_mocap.view
    on = view.list_overlays()
    gpu.state.blend_set("ALPHA")
    _taken.clear()
    try:
        for shown in found:
            if "moments" in on:
                _draw_labels(context, view, shown)
            if "seams" in on:
                _draw_reasons(context, view, shown)
        for place, text in labels:
            _draw_text(context, place, (text,), 1.0, (14, 14))
        draw_legend(context, [*(on if found else ()), *(["paths"] if has_paths else ()),
                              *(["shots"] if has_balls else ()), *(["momentum"] if labels else ())])
    finally:
        gpu.state.blend_set("NONE")


def _draw_labels(context, view, shown: DrawnTake) -> None:
    near = [label for label in shown.prepared.labels if abs(label.time - shown.seconds) <= view.reach]
    for label in near[:MOST_LABELS]:
        _draw_text(context, shown.world @ Vector(label.place), (label.text,), 1.0, (8, 26))


def _draw_reasons(context, view, shown: DrawnTake) -> None:
    """Draw clip names at the cuts around the playhead, and the reasons for the active body's clip beside it."""
    prepared, now = shown.prepared, shown.prepared.find_piece(shown.seconds)
    near = [p for p in prepared.pieces if p is not now and abs(p.start - shown.seconds) <= view.reach]
    for piece in near[:MOST_LABELS]:
        _draw_text(context, shown.world @ Vector(piece.place), (piece.name,), 0.8, (0, -10))
    if now is not None:
        x, y, z = prepared.pelvis[prepared.find_frame(shown.seconds)].tolist()
        lines = now.lines if shown.active else now.lines[:1]
        _draw_text(context, shown.world @ Vector((x, y, z)), lines, 1.0, (60, 60))


def _draw_text(context, where: Vector, lines, strength: float, shift: tuple[float, float]) -> None:
    """Draw lines `shift` points from a place in the world; nothing if it is behind the eye or outside the view."""
    region = context.region
    at = location_3d_to_region_2d(region, context.region_data, where)
    if at is None or not (-50 < at.x < region.width + 50 and -50 < at.y < region.height + 50):
        return
    scale = context.preferences.system.ui_scale
    x, y = at.x + shift[0] * scale, at.y + shift[1] * scale
    width, height = measure_lines(lines, scale)
    box = text_places.find_free_box((x, y, x + width, y + height), _taken, 2 * scale)
    if box is not None:
        _taken.append(box)
        draw_lines(box[0], box[1], lines, scale, strength)


def _build_scale_row(title: str, stops, factor: float, unit: str):
    """Build a legend row with a colour scale and its numbers."""

    def draw_row(x: float, y: float, scale: float) -> float:
        """Draw the row at pixel x, y; returns its height."""
        size, margin = SIZE * scale, MARGIN * scale
        step, width = LINE * size, SWATCH * scale
        height = 2 * step + 0.6 * size + 2 * margin
        draw_box(x, y, width + 6 * margin, height, GROUND)
        part = width / len(stops)
        blf.size(FONT, size)
        for number, (stop, rgb) in enumerate(zip(stops, colours.SCALE)):
            left = x + margin + number * part
            draw_box(left, y + margin + step, part, 0.6 * size, (*rgb, 1.0))
            _draw_line(left, y + margin + 0.2 * size, f"{factor * stop:g}", size)
        _draw_line(x + margin + width, y + margin + 0.2 * size, unit, size)
        _draw_line(x + margin, y + margin + step + 0.9 * size, title, size)
        return height

    return draw_row


def _build_key_row(*entries: tuple[str, tuple]):
    """Build a legend row of coloured squares with labels."""

    def draw_row(x: float, y: float, scale: float) -> float:
        """Draw the row at pixel x, y; returns its height."""
        size, margin = SIZE * scale, MARGIN * scale
        blf.size(FONT, size)
        widths = [blf.dimensions(FONT, text)[0] + 2.4 * size for text, _ in entries]
        height = LINE * size + 2 * margin
        draw_box(x, y, sum(widths) + 2 * margin, height, GROUND)
        left = x + margin
        for (text, rgb), width in zip(entries, widths):
            draw_box(left, y + margin + 0.25 * size, 0.8 * size, 0.8 * size, (*rgb, 1.0))
            _draw_line(left + 1.2 * size, y + margin + 0.3 * size, text, size)
            left += width
        return height

    return draw_row


def _draw_line(x: float, y: float, text: str, size: float) -> None:
    blf.size(FONT, size)
    blf.color(FONT, 1.0, 1.0, 1.0, 1.0)
    blf.position(FONT, x, y, 0.0)
    blf.draw(FONT, text)


WATCHER = Watcher(name="Drawing of overlays", ends=clear_batches,
                  draws=((bpy.types.SpaceView3D, _draw_shapes, "POST_VIEW"),
                         (bpy.types.SpaceView3D, _draw_texts, "POST_PIXEL")))
ROWS = {
    "track": _build_scale_row("Distance to track", colours.ROOT_STOPS, 100.0, "cm"),
    "footprints": _build_scale_row("Foot slide", colours.SLIDE_STOPS, 1000.0, "mm"),
    "speed": _build_key_row(("track speed", colours.TRACK_SPEED), ("body speed", colours.BODY_SPEED),
                            ("1 m high: 5 m/s", colours.GREY)), "contacts": _build_key_row(("left", colours.LEFT),
                                                                                           ("right", colours.RIGHT)),
    "heading": _build_key_row(("planned heading", colours.HEADING), ("heading key", colours.HEADING_KEY)),
    "paths": _build_key_row(("original", colours.SKY), ("new path", colours.ORANGE), ("tick: 1 s", colours.GREY)),
    "shots": _build_key_row(("ball trajectory", colours.WHITE), ("other candidates", colours.BLACK),
                            ("after the target", colours.VERMILION), ("striking part", colours.SKY),
                            ("strike", colours.STRIKE), ("bounce", colours.ORANGE)),
    "momentum": _build_key_row(("centre of mass", colours.WHITE), ("flight's parabola", colours.FLIGHT),
                               ("support polygon", colours.SUPPORT), ("ground force: 0.4 m for the weight",
                                                                      colours.FORCE),
                               ("force in the air", colours.UNSUPPORTED_FORCE)),
    "moments": _build_key_row(("strike point", colours.STRIKE), ("ball", colours.BALL), ("gap", colours.GAP)),
}
