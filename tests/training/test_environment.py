"""The environment that trains: jax and optax there, Blender not, and one line where they are missing."""

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from beyond_mocap.cli.main import main


def test_jax_is_there_and_blender_is_not():
    import jax.numpy as jnp
    import optax

    assert float(jnp.sum(jnp.arange(4))) == 6.0 and optax.adam(1e-3)
    assert find_spec("bpy") is None


def test_the_command_keeps_compiled_code(tmp_path):
    """jax reads where to keep it when it is imported, so that has to be set before."""
    code = ("from beyond_mocap.cli import throwing; throwing._require_training(); import jax; "
            "print(jax.config.jax_compilation_cache_dir)")
    environment = {name: text for name, text in os.environ.items() if name != "JAX_COMPILATION_CACHE_DIR"}
    done = subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).resolve().parents[2], text=True, check=True,
                          capture_output=True, env={**environment, "XDG_CACHE_HOME": str(tmp_path)})
    assert done.stdout.strip() == str(tmp_path / "beyond-mocap" / "compiled")


@pytest.mark.parametrize("missing", ["jax", "optax", "training"])
def test_without_it_one_line_says_what_to_do(missing, monkeypatch, tmp_path, capsys):
    monkeypatch.setitem(sys.modules, missing, None)
    assert main(["throw", "train", str(tmp_path), "--out", str(tmp_path / "w.npz")]) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1 and "make training" in said[0]
    assert list(tmp_path.iterdir()) == []
