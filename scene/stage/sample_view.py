"""How the sample is first seen: colours that read in a viewport that every computer draws quickly, and what was
generated in the middle of it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import bpy
from mathutils import Euler

SKY = (0.35, 0.50, 0.72)  # linear RGB behind the pitch
FROM_ABOVE, FROM_SIDE = math.radians(72.0), math.radians(28.0)  # of the free view: tilt from straight down, and turn
HIDDEN = ("floor", "axis_x", "axis_y", "cursor", "relationship_lines", "extras", "bones", "motion_paths")


def style_view(space: bpy.types.SpaceView3D) -> None:
    """Show materials' colours, shadows and a sky in the solid view of a 3D view, without helper lines over it."""
    shading, overlay = space.shading, space.overlay
    shading.type, shading.light = "SOLID", "STUDIO"  # the light first: it decides which studio lights exist
    shading.color_type, shading.studio_light = "MATERIAL", "paint.sl"
    shading.show_shadows, shading.shadow_intensity = True, 0.4
    shading.show_object_outline, shading.show_cavity = False, False
    shading.background_type, shading.background_color = "VIEWPORT", SKY
    for name in HIDDEN:
        setattr(overlay, f"show_{name}", False)


def look_through_camera(context: bpy.types.Context, area: bpy.types.Area) -> None:
    """Look through the scene's camera in a 3D view, its picture as large as the view."""
    space = area.spaces.active
    space.region_3d.view_perspective = "CAMERA"
    with context.temp_override(area=area, region=_find_region(area)):
        bpy.ops.view3d.view_center_camera()


def look_at(context: bpy.types.Context, area: bpy.types.Area, things: Iterable[bpy.types.Object]) -> None:
    """Look at objects from the side and a little from above, so that they fill a 3D view; the selection stays."""
    layer, region_3d = context.view_layer, area.spaces.active.region_3d
    chosen, active = list(context.selected_objects), layer.objects.active
    region_3d.view_perspective = "PERSP"
    region_3d.view_rotation = Euler((FROM_ABOVE, 0.0, FROM_SIDE)).to_quaternion()
    _select(layer, things, layer.objects.active)
    with context.temp_override(area=area, region=_find_region(area)):
        bpy.ops.view3d.view_selected()
    _select(layer, chosen, active)


def _select(layer: bpy.types.ViewLayer, things: Iterable[bpy.types.Object], active) -> None:
    """Select these objects and no others."""
    for thing in layer.objects:
        thing.select_set(False)
    for thing in things:
        thing.select_set(True)
    layer.objects.active = active


def _find_region(area: bpy.types.Area) -> bpy.types.Region:
    return next(region for region in area.regions if region.type == "WINDOW")
