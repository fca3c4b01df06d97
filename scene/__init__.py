"""Blender's own data: what the core's motions, tracks and clips become in a file. No buttons here.

A room for each feature, with what it does in its own docstring; docs/architecture.md has an overview. All stand on
`core`: channels, clock, background work, settings, registration, and the one live watcher.
"""

from .core import registration, session
from .core.live import start_watching, stop_watching
from .markers import solve
from .match import child


def register():
    """Register the data classes, attach them to Blender's own data, and begin to watch; where that fails, undo it and
    pass the error on."""
    registration.register_package(__name__)
    try:
        start_watching()
    except BaseException:
        unregister()
        raise


def unregister():
    """End what runs, undo what was registered, and forget what was kept in memory."""
    stop_watching()
    child.end_all()
    registration.unregister_package(__name__)
    session.clear()
    solve.forget_reconstructions()
