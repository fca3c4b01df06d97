"""The "Beyond Mocap" tab in the 3D viewport's sidebar: one module per feature, displayed in the order of `bl_order`."""

from ..scene.core import registration


def register():
    """Register the panels and the entries of Blender's menus."""
    registration.register_package(__name__)


def unregister():
    """Unregister them in reverse order."""
    registration.unregister_package(__name__)
