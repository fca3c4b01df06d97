"""Models of throws and kicks for tests: linear networks, quickly made, by a Python beside Blender's own core."""

import functools
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
from linear_throws import linear_model, planted_{act}
write_model(linear_model(planted_{act}(), {action!r}), {out!r})
"""


@functools.cache
def write_model_file(action="throw"):
    """Path of a model of "throw" or "kick"."""
    out = str(pathlib.Path(_folder.name) / f"{action}.npz")
    act = {"throw": "examples", "kick": "kicks"}[action]
    script = SCRIPT.format(core=str(TOP / "tests" / "core"), top=str(TOP), out=out, act=act, action=action)
    subprocess.run([sys.executable, "-c", script], check=True)
    return out
