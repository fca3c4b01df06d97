"""The command line inside Blender: `blender --command beyond_mocap VERB ...`, with Blender's own formats beside BVH."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import bpy

if TYPE_CHECKING:
    from ..beyond_mocap.cli.outputs import ProgressReporter

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

    return main(arguments, WRITERS, f"blender --command {NAME}", child.run_command, convert_recordings)


def convert_recordings(folder: Path, cache: Path | None, reporter: ProgressReporter) -> None:
    """Convert the FBX, glTF and USD recordings of a library that have changed since they were converted.

    Args:
        folder: the library's.
        cache: its cache folder, None for the default.
        reporter: progress, notes and cancellation.
    Raises:
        InputError: where there is no such folder, or its cache cannot be written.
        UserCancelledError: when the user cancels; finished conversions are kept.
    """
    from ..scene.library.foreign import ConversionQueue

    queue = ConversionQueue(folder, cache)
    while queue.remaining:
        reporter.check_cancelled()
        reporter.show_progress(1.0 - len(queue.remaining) / queue.total, f"Converting {queue.remaining[0].name}")
        queue.convert_next()
    reporter.finish(queue.notes)


def register():
    """Register the command with Blender."""
    _registered.append(bpy.utils.register_cli_command(NAME, run))


def unregister():
    """Unregister the command."""
    bpy.utils.unregister_cli_command(_registered.pop())
