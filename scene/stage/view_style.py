"""A solid view of the stage in which colours read and that every computer draws quickly."""

from __future__ import annotations

import bpy

SKY = (0.35, 0.50, 0.72)  # linear RGB behind the stage
HELPER_LINES = ("floor", "axis_x", "axis_y", "cursor", "relationship_lines")


def style_view(space: bpy.types.SpaceView3D, shows_empties: bool) -> None:
    """Show materials' colours, shadows and a sky in a 3D view, without Blender's grid over the pitch.

    Args:
        space: the 3D view.
        shows_empties: whether Empties, lights and cameras are shown.
    """
    shading, overlay = space.shading, space.overlay
    shading.type, shading.light = "SOLID", "STUDIO"  # the light first: it decides which studio lights exist
    shading.color_type, shading.studio_light = "MATERIAL", "paint.sl"
    shading.show_shadows, shading.shadow_intensity = True, 0.4
    shading.show_object_outline, shading.show_cavity = False, False
    shading.background_type, shading.background_color = "VIEWPORT", SKY
    for name in HELPER_LINES:
        setattr(overlay, f"show_{name}", False)
    overlay.show_extras = shows_empties
