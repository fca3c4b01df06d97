"""What `make test` tells the tests that it runs."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

TOP = Path(__file__).resolve().parents[2]
STUBS = """
include real.mk
venv venv-oldest training: ;
test-core test-training test-rooms test-operators test-oldest: ; @echo $@ $$BLENDERS_IN_TURN$$PYTHONDONTWRITEBYTECODE
"""


@pytest.mark.parametrize("oldest", [True, False])
def test_two_blenders_take_turns_one_tries_all_and_what_is_compiled_is_kept(tmp_path, oldest):
    if shutil.which("make") is None:
        pytest.skip("no make here")
    shutil.copy(TOP / "Makefile", tmp_path / "real.mk")
    (tmp_path / "Makefile").write_text(STUBS)
    (tmp_path / ".venv-4.5").mkdir() if oldest else None
    ours = {name: value for name, value in os.environ.items() if name != "BLENDERS_IN_TURN" and "MAKE" not in name}
    ours["PYTHONDONTWRITEBYTECODE"] = "1"
    made = subprocess.run(["make", "-s", "test"], cwd=tmp_path, env=ours, capture_output=True, text=True, check=True)
    told = dict(line.partition(" ")[::2] for line in made.stdout.splitlines() if line.startswith("test-"))
    turn = "1" if oldest else ""
    assert [told[name] for name in ("test-rooms", "test-operators", "test-oldest")] == 3 * [turn]


def test_what_contributors_are_told_to_run_is_in_the_help():
    named = set(re.findall(r"`make ([a-z-]+)", (TOP / "CONTRIBUTING.md").read_text("utf-8"))) - {"help"}
    shown = re.findall(r"echo '(?:make ([a-z-]+))", (TOP / "Makefile").read_text("utf-8"))
    assert len(named) > 10 and named <= set(shown), named - set(shown)
