"""A cost term with a setting is one row of the table and one named part of the costs
(docs/explanation/architecture.md)."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

TOP = Path(__file__).resolve().parents[4]
ROW = """        Setting(name="walking_cost", default=0.0, least=0.0, most=10.0, option="--walking-cost",
            methods="path", help="of missed speed that a walking clip costs", tooltip="Costs of walking"),
"""
TERM = """        walks = self.index.shows_labels(frozenset(("walking",)))[frame]
        yield "walking_cost", np.float32(self.request.plan.walking_cost) * walks
"""
TRY = """
from beyond_mocap.base.errors import InputError
from beyond_mocap.library.build import build_library
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resolve_plan import resolve_plan
from beyond_mocap.synthesis.search.explanation import explain_choices
from beyond_mocap.synthesis.synthesize import synthesize
import numpy as np, sys
library = build_library(sys.argv[1])
times = np.arange(0.0, 4.0, 0.1)
track = Track(times, np.stack([1.4 * times, 0.0 * times], axis=1))
for walking_cost in (0.0, 0.7):
    take = synthesize(library, Plan(track=track, walking_cost=walking_cost))
    found = explain_choices(library, resolve_plan(take.plan, library), take.edit)
    print(round(sum(reason.costs.get("walking_cost", 0.0) for reason in found), 3))
try:
    Plan(track=track, walking_cost=11.0)
except InputError as error:
    print(error)
"""


def plant(path, before, line):
    text = path.read_text("utf-8")
    assert text.count(before) == 1
    path.write_text(text.replace(before, line + before), "utf-8")


def test_two_files_make_a_term_that_users_weigh(clips_folder, tmp_path):
    shutil.copytree(TOP / "beyond_mocap", tmp_path / "beyond_mocap", ignore=shutil.ignore_patterns("__pycache__"))
    core = tmp_path / "beyond_mocap"
    plant(core / "base/settings/synthesis.py", '        Setting(name="mirror"', ROW)
    plant(core / "synthesis/search/path_costs.py", '        yield "unasked"', TERM)
    shown = {**os.environ, "PYTHONPATH": str(tmp_path)}
    said = subprocess.run([sys.executable, "-c", TRY, str(clips_folder)], env=shown, cwd=tmp_path, capture_output=True,
                          text=True, timeout=120)  # fmt: skip
    assert said.returncode == 0, said.stderr
    without, weighed, limits = said.stdout.splitlines()
    assert (float(without), limits) == (0.0, "walking_cost: 11; expected 0 to 10") and float(weighed) > 0.0, said
    listed = subprocess.run([sys.executable, "-m", "beyond_mocap", "synthesize", "--help"], env=shown, cwd=tmp_path,
                            capture_output=True, text=True, timeout=120)  # fmt: skip
    assert "--walking-cost" in listed.stdout
