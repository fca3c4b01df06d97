"""The Blender side: turns the core's motions, tracks and clips into data of a .blend file. It contains no buttons.

There is one package for each feature, described in its own docstring; docs/explanation/architecture.md has an overview.
All use `core`: channels, clock, background work, settings, registration, and the one live watcher.
"""

REGISTERED = ("ball", "characters", "core", "library", "markers", "match", "overlays", "passes", "path_editing",
              "player", "result", "rigs", "stage", "stream", "throws", "timeline")


def register():
    """Register the data classes, attach them to Blender's own data, and start watching; undo it all if a step fails."""
    from .core import live, registration

    registration.register_package(__name__)
    try:
        live.start_watching()
    except BaseException:
        unregister()
        raise


def unregister():
    """Stop what runs, undo the registration, and clear what is stored in memory."""
    from .core import live, registration, session

    live.stop_watching()
    from .markers import solve
    from .match import command_process

    command_process.stop_all()
    registration.unregister_package(__name__)
    session.clear_session()
    solve.clear_reconstructions()
