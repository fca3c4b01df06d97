"""The commands for farms that only know --python:

    blender -b FILE.blend --python batch.py -- synthesize --library clips --track p.csv --annotations p.txt --out p.fbx

Takes the verbs of `python -m beyond_mocap` and ends with their exit status. Uses the extension where it is switched on,
else the code that lies beside this file, so that nothing has to be installed.
"""

import importlib
import importlib.util
import pathlib
import sys

BESIDE = "beyond_mocap_batch"


def extension():
    """The name of the loaded extension's package; that of the folder of this file where none is switched on."""
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
    """Run the command after `--`; returns its exit status."""
    arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    command = importlib.import_module(f"{extension()}.operators.command")
    return command.run(arguments)


if __name__ == "__main__":
    sys.exit(main())
