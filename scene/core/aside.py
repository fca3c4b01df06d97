"""A scene of its own for work that needs Blender's importers, exporters or modes, and must leave nothing behind."""

from __future__ import annotations

from contextlib import contextmanager, nullcontext

import bpy


@contextmanager
def scene_aside(name: str):
    """A new scene, in the window where there is one, else in the context; all data that comes in meanwhile is removed
    at the end, and the scene and view layer from before are shown again."""
    before, window = set(_all_data()), bpy.context.window
    home, layer = (window.scene, window.view_layer.name) if window is not None else (None, "")
    scene = bpy.data.scenes.new(name)
    try:
        if window is not None:
            window.scene = scene
        with nullcontext() if window is not None else bpy.context.temp_override(
                scene=scene, view_layer=scene.view_layers[0]):
            yield scene
    finally:
        if window is not None:
            window.scene = home
            window.view_layer = home.view_layers[layer]
        came = [item for key, item in _all_data().items() if key not in before]
        bpy.data.batch_remove([item for item in came if not isinstance(item, bpy.types.Scene)])
        for item in [item for item in came if isinstance(item, bpy.types.Scene)]:
            bpy.data.scenes.remove(item)


def _all_data() -> dict:
    """All that the file holds, by identity: newer Blenders list the same things under several names."""
    found = {}
    for name in dir(bpy.data):
        kind = getattr(bpy.data, name)
        if isinstance(kind, bpy.types.bpy_prop_collection) and name not in {"window_managers", "screens", "workspaces"}:
            found.update({item.session_uid: item for item in kind if hasattr(item, "session_uid")})
    return found
