"""The stage: a sport's pitch of any size, with goals, stands, light, sky and cameras.

A scene has one stage, for single players and for matches alike.
"""

from __future__ import annotations

import bpy

from ..core.measure import units_per_metre
from . import cameras, lighting
from .goals import create_goals
from .pitch import create_boards, create_pitch
from .stage_collection import (
    PITCH_SIZE,
    STAGE_MARK,
    find_pitch_size,
    find_sport,
    find_stage,
    get_stage,
    list_own_objects,
)
from .stage_collection import remove_objects as _remove_objects
from .stands import create_stands

RENDER_SAMPLES = 32  # of EEVEE: soft shadows and thin lines are smooth, and a frame takes a second or two


def create_stage(scene: bpy.types.Scene, size: tuple[float, float] | None = None) -> bpy.types.Collection:
    """Create the stage, or create it again in place of the older one; its cameras stay.

    Args:
        scene: the scene.
        size: length and width of the pitch, m; None for those of the older stage, else the regular size.
    Returns:
        The collection.
    """
    size = tuple(size or find_pitch_size(scene))
    stage = get_stage(scene)
    is_new = PITCH_SIZE not in stage  # none, only cameras, or one of version 0.1
    _remove_objects([thing for thing in list_own_objects(stage) if not cameras.is_part_of_view(thing)])
    stage[STAGE_MARK], stage[PITCH_SIZE] = True, size
    units, before, sport = units_per_metre(scene), set(stage.objects), find_sport(scene)
    create_pitch(stage, units, sport, size)
    create_goals(stage, units, sport.goal, size[0])
    if sport.boards:
        create_boards(stage, units, sport, size)
    if scene.beyond_mocap_stage.stands:
        create_stands(stage, units, (size[0] + 2.0 * sport.behind, size[1]))
    settings = scene.beyond_mocap_stage
    lighting.create_lights(stage, units, size, settings.light, masts=not settings.stands)
    for thing in set(stage.objects) - before:
        thing[STAGE_MARK] = True
    lighting.set_sky(scene, scene.beyond_mocap_stage.light)
    if is_new:
        lighting.set_exposure(scene)
        _set_render(scene)
    return stage


def find_pitch(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Find ground, lines, boards and goals of the scene's stage."""
    stage = find_stage(scene)
    names = ("Grass", "Lines", "Goal", "Net", "Boards")
    return [thing for thing in list_own_objects(stage) if thing.name.startswith(names)] if stage is not None else []


def _set_render(scene: bpy.types.Scene) -> None:
    """Set up EEVEE for sport: shadows, few samples, no heavy effects."""
    scene.eevee.taa_render_samples = min(scene.eevee.taa_render_samples, RENDER_SAMPLES)
    scene.eevee.use_shadows = True
    scene.eevee.use_raytracing = False
