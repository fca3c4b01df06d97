"""Beyond Mocap: full-body animation from tracking data and labels, inside Blender.

This file only registers and unregisters the extension. Its packages are registered in the order of ROOMS and
unregistered in reverse order; each does the same with its own modules. `bpy` is first imported when `register()` runs,
so this folder can be read as a plain Python package (by a test collector) without Blender.
"""

ROOMS = ("scene", "operators", "panels")


def register():
    """Register all packages; if one fails, unregister those before it and raise its error."""
    standing = []
    try:
        for room in _rooms():
            room.register()
            standing.append(room)
    except BaseException:
        for room in reversed(standing):
            room.unregister()
        raise


def unregister():
    """Unregister all packages in reverse order."""
    for room in reversed(list(_rooms())):
        room.unregister()


def _rooms():
    from importlib import import_module

    return (import_module(f".{name}", __package__) for name in ROOMS)
