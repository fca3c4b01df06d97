"""The command line inside Blender: `blender --command beyond_mocap VERB ...`, with Blender's own formats beside BVH."""

from __future__ import annotations

import bpy

NAME = "beyond_mocap"

_registered = []


def run(arguments: list[str]) -> int:
    """Run one command line; returns its exit status."""
    from ..beyond_mocap.cli.main import main
    from ..scene.match import child
    from ..scene.rigs.deliver import WRITERS

    return main(arguments, WRITERS, f"blender --command {NAME}", child.run)


def register():
    """Make the command known to Blender."""
    _registered.append(bpy.utils.register_cli_command(NAME, run))


def unregister():
    """Take it away."""
    bpy.utils.unregister_cli_command(_registered.pop())
