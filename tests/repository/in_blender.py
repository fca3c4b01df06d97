"""One step of test_install.py inside a Blender, real or a Python module: install from a repository, or update from it.

    blender -b --online-mode --python in_blender.py -- install URL FOLDER
    blender -b --online-mode --python in_blender.py -- update FOLDER

FOLDER keeps what a user has saved.
"""

import json
import os
import pathlib
import sys
import time
import tomllib
import traceback

import bpy

# isort: split
import addon_utils
from bl_pkg.bl_extension_cli import cli_extension_handler

EXTENSION = "bl_ext.ours.beyond_mocap"
SAVED_BY_0_1 = pathlib.Path(__file__).resolve().parents[1] / "data" / "saved_by_0_1.blend"


def run_tool(*arguments):
    """Run what `blender --command extension` runs."""
    assert cli_extension_handler(list(arguments)) == 0, arguments


def install(url, folder):
    """Add the repository, install and enable the extension, and save what a user saves."""
    run_tool("repo-add", "ours", "--name", "Ours", "--url", url, "--clear-all")  # without Blender's own, far away
    run_tool("sync")
    run_tool("install", "beyond_mocap", "--enable")
    assert addon_utils.check(EXTENSION)[1], "the extension is not enabled"
    bpy.context.preferences.addons[EXTENSION].preferences.threads = 3
    bpy.ops.wm.save_userpref()
    bpy.context.scene.beyond_mocap.players.add().name = "Ada"
    bpy.context.scene.beyond_mocap.library_folder = "//clips"
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "saved.blend"))
    find_own_folder().joinpath("kept.txt").write_text("kept")


def update(folder):
    """Update the extension, then find all that was saved."""
    run_tool("sync")
    run_tool("update")
    assert bpy.context.preferences.addons[EXTENSION].preferences.threads == 3
    assert find_own_folder().joinpath("kept.txt").read_text() == "kept"
    bpy.ops.wm.open_mainfile(filepath=os.path.join(folder, "saved.blend"))
    settings = bpy.context.scene.beyond_mocap
    assert [player.name for player in settings.players] == ["Ada"] and settings.library_folder == "//clips"
    bpy.ops.wm.open_mainfile(filepath=str(SAVED_BY_0_1))
    assert len(bpy.context.scene.beyond_mocap.players) == 2


def find_own_folder():
    """The folder in which the extension keeps files of its user."""
    return pathlib.Path(bpy.utils.extension_path_user(EXTENSION, path="samples", create=True))


def report(start):
    """Print the installed version, the Blender and the seconds in all."""
    import scipy

    own = pathlib.Path(sys.modules[EXTENSION].__file__).parent
    manifest = tomllib.loads((own / "blender_manifest.toml").read_text("utf-8"))
    print("REPORT", json.dumps({"version": manifest["version"], "blender": bpy.app.version_string,
                                "python": sys.version.split()[0], "scipy": scipy.__file__,
                                "seconds": round(time.monotonic() - start, 1)}), flush=True)


def main():
    """Do the step; end without Blender's own ending, which may hang."""
    started, status = time.monotonic(), 0
    verb, *arguments = sys.argv[sys.argv.index("--") + 1 :]
    try:
        if bpy.app.module:  # it begins without the user's preferences
            bpy.ops.wm.read_userpref()
        bpy.context.preferences.system.use_online_access = True
        {"install": install, "update": update}[verb](*arguments)
        report(started)
    except BaseException:
        traceback.print_exc()
        status = 1
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


main()
