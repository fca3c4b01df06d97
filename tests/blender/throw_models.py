"""Models of throws and kicks for tests: linear networks, quickly made, by a Python beside Blender's own core."""

import functools
import os
import pathlib
import subprocess
import sys
import tempfile

TOP = pathlib.Path(__file__).resolve().parents[2]
_folder = tempfile.TemporaryDirectory(prefix="beyond-mocap-models-")
SCRIPT = """
import sys
sys.path[:0] = [{core!r}, {top!r}]
from beyond_mocap.throws.network_npz import write_model
from linear_throws import build_linear_model, build_{action_name}_examples
write_model(build_linear_model(build_{action_name}_examples(), {action!r}), {out!r})
"""


@functools.cache
def write_model_file(action="throw"):
    """Path of a model of "throw" or "kick"; the runs of `make test` share it."""
    out = pathlib.Path(os.environ.get("TESTS_CACHE") or _folder.name) / f"{action}.npz"
    if not out.exists():
        out.parent.mkdir(parents=True, exist_ok=True)
        script = SCRIPT.format(core=str(TOP / "tests" / "core"), top=str(TOP), out=str(out), action_name=action,
                               action=action)
        subprocess.run([sys.executable, "-c", script], check=True)
    return str(out)
