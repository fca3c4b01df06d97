"""The command line inside Blender: `blender --command beyond_mocap VERB ...`, with Blender's own formats beside BVH."""

from __future__ import annotations

import bpy

NAME = "beyond_mocap"

_registered = []


def run(arguments: list[str]) -> int:
    """Run one command line.

    Args:
        arguments: the command line without the program's name.
    Returns:
        The exit status.
    """
    from ..beyond_mocap.cli.main import main
    from ..scene.match import command_process as child
    from ..scene.rigs.deliver import WRITERS

    return main(arguments, WRITERS, f"blender --command {NAME}", child.run_command)


def register():
    """Register the command with Blender."""
    _registered.append(bpy.utils.register_cli_command(NAME, run))


def unregister():
    """Unregister the command."""
    bpy.utils.unregister_cli_command(_registered.pop())
