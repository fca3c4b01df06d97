"""The command line for render farms that only know --python:

    blender -b FILE.blend --python batch.py -- synthesize --library clips --track p.csv --annotations p.txt --out p.fbx

It takes the verbs of `python -m beyond_mocap` and exits with their status. It uses the extension if it is enabled,
otherwise the code beside this file, so that nothing has to be installed.
"""

import importlib.util
import pathlib
import sys

REPOSITORY = "beyond_mocap_batch"


def find_extension():
    """Find the package of the enabled extension; without one, that of this file's folder.

    Blender itself makes the folder importable: it becomes an extension repository of this session.

    Returns:
        The package's name.
    """
    import bpy

    preferences = bpy.context.preferences
    for name in preferences.addons.keys():
        if name.startswith("bl_ext.") and name.endswith(".beyond_mocap") and importlib.util.find_spec(name):
            return name
    folder, saved = pathlib.Path(__file__).resolve().parent, preferences.is_dirty
    preferences.extensions.repos.new(name=REPOSITORY, module=REPOSITORY, custom_directory=str(folder))
    preferences.is_dirty = saved  # nothing to save: the repository is gone when Blender ends
    return f"bl_ext.{REPOSITORY}"


def main():
    """Run the command after `--`; return its exit status."""
    arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    package = find_extension()
    if package.endswith(REPOSITORY):  # nothing has registered it; a scene that is written has its properties
        importlib.import_module(f"{package}.__init__").register()
    return importlib.import_module(f"{package}.operators.command").run(arguments)


if __name__ == "__main__":
    sys.exit(main())
