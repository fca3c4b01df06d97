"""The handlers of the 3D view. Nothing is worked out here: batches are made once of what `prepare` made, then drawn.

Depth is tested against the scene with a small bias towards the eye, since what lies on the ground lies there with the
pitch's own lines, and far away the depth buffer cannot tell centimetres.
"""

from __future__ import annotations

from typing import NamedTuple

import bpy
import gpu
from bpy_extras.view3d_utils import location_3d_to_region_2d
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix, Vector

from ..core.live import Watcher
from ..core.settings import active_player
from . import ball_rallies, ball_shots, colours, legend, place, rides, shapes, store
from .prepare import Mesh, Prepared

BIAS = 1e-5
DISC, LIFT = 0.12, 0.034  # metres: radius of a contact's disc, its height above the ground
MOST_LABELS = 12

_batches: dict[tuple, list] = {}
_owners: dict[str, Prepared] = {}


class Shown(NamedTuple):
    """One player as drawn: name and body, what is prepared, where it lies, its clock."""

    take: str
    prepared: Prepared
    world: Matrix
    seconds: float
    active: bool


def free() -> None:
    """Free what was drawn."""
    _batches.clear()
    _owners.clear()
    legend.free()


def _shown(context) -> list[Shown]:
    """What there is to draw in this view; [] where overlays are switched off or nothing is prepared."""
    settings = getattr(context.scene, "beyond_mocap", None)
    space = context.space_data
    if settings is None or not settings.view.on() or not space.overlay.show_overlays:
        return []
    active, seconds = active_player(settings), place.seconds_at(context.scene)
    found = []
    for player in store.shown_players(settings):
        prepared = store.prepared(player.take)
        if prepared is not None:
            world = place.take_to_world(context.scene, player.body)
            found.append(Shown(player.take, prepared, world, seconds, player == active))
    _forget({shown.take: shown.prepared for shown in found})
    return found


def _forget(now: dict[str, Prepared]) -> None:
    """Free the batches of takes that are drawn no more."""
    gone = {take for take, owner in _owners.items() if store.prepared(take) is not owner}
    for key in [key for key in _batches if key[0] in gone]:
        del _batches[key]
    for take in gone:
        del _owners[take]
    _owners.update(now)


def _riding(context) -> list[rides.Item]:
    """What there is to draw of riders and balls in this view; the batches of what is drawn no more are freed."""
    items = []
    if context.space_data.overlay.show_overlays and getattr(context.scene, "beyond_mocap", None) is not None:
        items = [*rides.items(context.scene), *ball_shots.items(context.scene), *ball_rallies.items(context.scene)]
    now = {item.key for item in items}
    for key in [key for key in _batches if not isinstance(key[0], str) and key not in now]:
        del _batches[key]
    return items


def _draw_shapes():
    context = bpy.context
    found, riding = _shown(context), _riding(context)
    if not found and not riding:
        return
    view = context.scene.beyond_mocap.view
    with gpu.matrix.push_pop_projection():
        projection = gpu.matrix.get_projection_matrix()
        projection[2] -= BIAS * projection[3]
        gpu.matrix.load_projection_matrix(projection)
        gpu.state.blend_set("ALPHA")
        gpu.state.depth_test_set("NONE" if view.in_front else "LESS_EQUAL")
        gpu.state.depth_mask_set(False)
        try:
            for shown in found:
                with gpu.matrix.push_pop():
                    gpu.matrix.multiply_matrix(shown.world)
                    for name in view.on():
                        _draw_overlay(context, view, name, shown)
            for item in riding:
                with gpu.matrix.push_pop():
                    gpu.matrix.multiply_matrix(item.world)
                    _draw_batches(context, _made(item.key, item.meshes))
        finally:
            gpu.state.depth_mask_set(True)
            gpu.state.depth_test_set("NONE")
            gpu.state.blend_set("NONE")


def _draw_overlay(context, view, name: str, shown: Shown) -> None:
    if name == "contacts":
        _draw_contacts(shown)
    elif name == "ghosts":
        for frame in _ghost_frames(view, shown):
            _draw_batches(context, _made((shown.take, "ghost", frame), lambda: [_figure(shown.prepared, frame)]))
    else:
        _draw_batches(context, _made((shown.take, name), lambda: shown.prepared.meshes.get(name, ())))


def _ghost_frames(view, shown: Shown) -> list[int]:
    """Frames of the figures near the playhead; the one at the playhead is the body itself."""
    prepared = shown.prepared
    first, now, last = (prepared.frame(shown.seconds + side * view.reach) for side in (-1, 0, 1))
    if view.ghosts_at == "SEAMS":
        return [frame for frame in prepared.seams if first <= frame <= last]
    step = max(1, round(view.ghost_step * prepared.fps))
    return [frame for frame in range(-(-first // step) * step, last + 1, step) if frame != now]


def _figure(prepared: Prepared, frame: int) -> Mesh:
    points = prepared.figures[frame][prepared.pairs].reshape(-1, 3)
    return Mesh("LINES", points, prepared.pair_colours, 2.0)


def _made(key: tuple, meshes) -> list:
    """The batches of one overlay, made when it is first drawn."""
    if key not in _batches:
        _batches[key] = [
            (batch_for_shader(_shader(mesh.kind), mesh.kind, {"pos": mesh.points, "color": mesh.colours}), mesh)
            for mesh in meshes()
        ]
    return _batches[key]


def _shader(kind: str):
    return gpu.shader.from_builtin("POLYLINE_FLAT_COLOR" if kind == "LINES" else "SMOOTH_COLOR")


def _draw_batches(context, batches) -> None:
    for batch, mesh in batches:
        shader = _shader(mesh.kind)
        shader.bind()
        if mesh.kind == "LINES":
            shader.uniform_float("viewportSize", (context.region.width, context.region.height))
            shader.uniform_float("lineWidth", mesh.width * context.preferences.system.ui_scale)
        batch.draw(shader)


def _draw_contacts(shown: Shown) -> None:
    """A disc under each foot that stands now."""
    prepared, frame = shown.prepared, shown.prepared.frame(shown.seconds)
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    for side, rgb in enumerate((colours.LEFT, colours.RIGHT)):
        if prepared.stands[frame, side]:
            x, y, _ = prepared.toes[frame, side].tolist()
            with gpu.matrix.push_pop():
                gpu.matrix.translate((x, y, LIFT))
                shader.bind()
                shader.uniform_float("color", (*rgb, 0.75))
                _made(("", "disc"), _disc)[0][0].draw(shader)


def _disc() -> list[Mesh]:
    points = shapes.disc(DISC)
    return [Mesh("TRIS", points, colours.repeated(colours.WHITE, len(points)))]


def _draw_texts():
    context = bpy.context
    found, riding, shot = _shown(context), _rides(context), _shots(context)
    if not found and not riding and not shot:
        return
    view = context.scene.beyond_mocap.view
    on = view.on()
    gpu.state.blend_set("ALPHA")
    try:
        for shown in found:
            if "moments" in on:
                _near_labels(context, view, shown)
            if "seams" in on:
                _why(context, view, shown)
        legend.draw(context, [*(on if found else ()), *(["rides"] if riding else ()), *(["shots"] if shot else ())])
    finally:
        gpu.state.blend_set("NONE")


def _rides(context) -> bool:
    """Whether anything of riders is drawn in this view."""
    return context.space_data.overlay.show_overlays and bool(rides.seen(context.scene))


def _shots(context) -> bool:
    """Whether anything of balls is drawn in this view."""
    shown = context.space_data.overlay.show_overlays
    return shown and (bool(ball_shots.seen(context.scene)) or ball_rallies.seen(context.scene) is not None)


def _near_labels(context, view, shown: Shown) -> None:
    near = [label for label in shown.prepared.labels if abs(label.time - shown.seconds) <= view.reach]
    for label in near[:MOST_LABELS]:
        _text(context, shown.world @ Vector(label.place), (label.text,), 1.0, (8, 26))


def _why(context, view, shown: Shown) -> None:
    """Clip names at the cuts around the playhead, and beside the active body why its clip is played."""
    prepared, now = shown.prepared, shown.prepared.piece(shown.seconds)
    near = [p for p in prepared.pieces if p is not now and abs(p.start - shown.seconds) <= view.reach]
    for piece in near[:MOST_LABELS]:
        _text(context, shown.world @ Vector(piece.place), (piece.name,), 0.8, (0, -10))
    if now is not None:
        x, y, z = prepared.pelvis[prepared.frame(shown.seconds)].tolist()
        lines = now.lines if shown.active else now.lines[:1]
        _text(context, shown.world @ Vector((x, y, z)), lines, 1.0, (60, 60))


def _text(context, where: Vector, lines, strength: float, shift: tuple[float, float]) -> None:
    """Lines on a dark ground with their lower left corner `shift` points from a place in the world; nothing where it is
    behind the eye or outside."""
    region = context.region
    at = location_3d_to_region_2d(region, context.region_data, where)
    if at is None or not (-50 < at.x < region.width + 50 and -50 < at.y < region.height + 50):
        return
    scale = context.preferences.system.ui_scale
    legend.write(at.x + shift[0] * scale, at.y + shift[1] * scale, lines, scale, strength)


WATCHER = Watcher(name="Drawing of overlays", ends=free, draws=(
    (bpy.types.SpaceView3D, _draw_shapes, "POST_VIEW"), (bpy.types.SpaceView3D, _draw_texts, "POST_PIXEL"),
))
