"""Play a file of window checks inside Blender, and end Blender with what came of them: 0 all passed, 1 not.

    blender --enable-event-simulate --python tests/gui/play.py -- tests/gui/checks.py

A file of checks holds generators named `check_...` (see window.py), which are played in the order of the file. All
names of tab.py, `output` and `window` among them, are there without an import. A check fails with an AssertionError, or
where drawing printed an error meanwhile; a failed check is told, its picture kept, and the next one goes on.
"""

import importlib.util
import pathlib
import sys
import time
import traceback

import bpy

sys.path.insert(0, "tests/gui")  # Blender does not put a script's folder there; the current one is the clone's top
import tab  # noqa: E402
from window import run_script  # noqa: E402

LIMIT = 1500  # seconds for a whole file; only what hangs takes so long, on any machine


def load_checks(path):
    """The file at `path` as a module that knows tab.py's names."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    vars(module).update({name: value for name, value in vars(tab).items() if not name.startswith("__")})
    spec.loader.exec_module(module)
    return module


def run_checks(module):
    """Run the module's checks one after the other; the status is 1 where one failed."""
    checks = [value for name, value in vars(module).items() if name.startswith("check_")]
    failed, start_time = 0, time.monotonic()
    for check in checks:
        name, mark = check.__name__.removeprefix("check_").replace("_", " "), len(tab.output.text())
        start, worked = time.monotonic(), time.process_time()
        try:
            yield from check()
            yield 0.2  # what the last step changed is drawn
            if not getattr(check, "plants_trouble", False):
                tab.assert_no_errors_since(mark)
            spent = time.monotonic() - start, time.process_time() - worked
            tab.output.write_line(f"ok   {name} ({spent[0]:.0f} s, of the processors {spent[1]:.0f} s)")
        except Exception:
            failed += 1
            tab.window.save_picture(tab.PICTURES / f"failed-{check.__name__}.png")
            tab.output.write_line(f"FAIL {name}\n{traceback.format_exc()}")
    (tab.PICTURES / f"{module.__name__}.txt").write_text(tab.output.text(), "utf-8")
    summary = f"{len(checks) - failed} passed, {failed} failed in {time.monotonic() - start_time:.0f} s"
    summary += f", of the processors {time.process_time():.0f} s"
    tab.output.write_line(f"{module.__name__}: {summary}, Blender {bpy.app.version_string}")
    return min(failed, 1) if checks else 1


tab.PICTURES.mkdir(parents=True, exist_ok=True)
bpy.context.preferences.view.show_splash = False
bpy.context.preferences.system.viewport_aa = "OFF"  # without a graphics card, half of all work
bpy.context.preferences.view.smooth_view = 0
bpy.context.preferences.system.use_region_overlap = False  # else each move over the sidebar draws the whole view anew
check_module = load_checks(pathlib.Path(sys.argv[sys.argv.index("--") + 1]))
run_script(lambda: run_checks(check_module), tab.output, LIMIT)
