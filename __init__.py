"""Beyond Mocap: full-body animation from tracking data and labels, inside Blender.

This file only registers and unregisters the extension. Its packages are registered in the order of ROOMS and
unregistered in reverse order; each does the same with its own modules. `bpy` is first imported when `register()` runs,
so this folder can be read as a plain Python package (by a test collector) without Blender.
"""

PACKAGES = ("scene", "operators", "panels")


def register():
    """Register all packages; if one fails, unregister those before it and raise its error."""
    registered = []
    try:
        for package in _iter_packages():
            package.register()
            registered.append(package)
    except BaseException:
        for package in reversed(registered):
            package.unregister()
        raise


def unregister():
    """Unregister all packages in reverse order."""
    for package in reversed(list(_iter_packages())):
        package.unregister()


def _iter_packages():
    from importlib import import_module

    return (import_module(f".{name}", __package__) for name in PACKAGES)
