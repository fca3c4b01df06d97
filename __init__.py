"""Beyond Mocap: from tracked dots and a few words to a moving body, inside Blender.

This file only switches the extension on and off. Its rooms are registered in the
order of ROOMS and unregistered in the reverse order; each room does the same with
its own parts. Blender's `bpy` is first imported when `register()` runs, so reading
this folder as a plain Python package (a test collector does) needs no Blender.
"""

ROOMS = ("scene", "operators", "panels")


def register():
    """Switch every room on; when one fails, switch off those before it and pass the error on."""
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
    """Switch every room off, the last one first."""
    for room in reversed(list(_rooms())):
        room.unregister()


def _rooms():
    from importlib import import_module

    return (import_module(f".{name}", __package__) for name in ROOMS)
