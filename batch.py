"""The command line for render farms that only know --python:

    blender -b FILE.blend --python batch.py -- synthesize --library clips --track p.csv --annotations p.txt --out p.fbx

It takes the verbs of `python -m beyond_mocap` and exits with their status. It uses the extension if it is enabled,
otherwise the code beside this file, so that nothing has to be installed.
"""

import importlib
import importlib.util
import pathlib
import sys

BESIDE = "beyond_mocap_batch"


def extension():
    """Find the package of the enabled extension; without one, load the folder of this file.

    Returns:
        The package's name.
    """
    import bpy

    enabled = [name for name in bpy.context.preferences.addons.keys() if name.startswith("bl_ext.")]
    for name in enabled:
        if name.endswith(".beyond_mocap") and name in sys.modules:
            return name
    folder = pathlib.Path(__file__).resolve().parent
    spec = importlib.util.spec_from_file_location(
        BESIDE, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    package = importlib.util.module_from_spec(spec)
    sys.modules[BESIDE] = package
    spec.loader.exec_module(package)
    return BESIDE


def main():
    """Run the command after `--`; return its exit status."""
    arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    command = importlib.import_module(f"{extension()}.operators.command")
    return command.run(arguments)


if __name__ == "__main__":
    sys.exit(main())
