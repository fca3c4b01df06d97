"""`make experiments` on two tiny rows: stopped by its time and killed, it continues to the same results."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from beyond_mocap.throws.synthetic_examples import write_examples
from training.experiments import EXPERIMENTS, main, read_experiments
from training.fit import read_progress

TOP = Path(__file__).resolve().parents[2]
TINY = {"kind": "single", "units": 8, "layers": 1, "points": 1, "fps": 15.0, "rollout": 1, "batch": 32, "examples": 4,
        "guided": False, "carried": False, "conditioned": False, "mirrored": False, "early_stopping": False}
ROWS = {
    "start": {"title": "linear", "config": {**TINY, "units": 64, "epochs": 0, "ridge": 0.1, "start_noise": 0.0}},
    "chance": {"title": "random", "config": {**TINY, "epochs": 8, "linear_start": False}},
}


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("experiments")
    write_examples(folder / "people", "throw", 2, 1, 0)
    first, second = sorted({line.split(",")[1] for line in
                            (folder / "people" / "throws.csv").read_text("utf-8").splitlines()[1:]})
    (folder / "rows.json").write_text(json.dumps({
        "action": "throw", "training": {"folder": "people", "subjects": [first]},
        "tests": {"the other": {"folder": "people", "subjects": [second]}}, "rows": ROWS,
    }))  # fmt: skip
    return folder


def words(data, out, hours):
    return ["--experiments", f"{data}/rows.json", "--data", str(data), "--out", str(out), "--hours", str(hours)]


def results(out):
    """What the reports of all rows say, but for times."""
    found = {name: json.loads((out / f"{name}.json").read_text("utf-8")) for name in ROWS}
    for report in found.values():
        del report["seconds"]
        for kind in report["tests"]["the other"].values():
            del kind["seconds"]
            for one in kind["each"]:
                del one["seconds"]
    return found


def kill_after(path, epoch, command):
    """Start a command and kill it as soon as the checkpoint says that it has trained so far."""
    process = subprocess.Popen([sys.executable, "-m", "training.experiments", *command], cwd=TOP,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while process.poll() is None and read_progress(path).epoch < epoch:
        time.sleep(0.02)
    process.kill()
    return process.wait()


def test_stopped_and_killed_it_continues_to_the_same_results(data, tmp_path):
    whole, parted = tmp_path / "whole", tmp_path / "parted"
    assert main(words(data, whole, 1)) == main(words(data, parted, 0)) == 0
    table = (parted / "experiments.md").read_text("utf-8")
    assert "- random: reached 2 of 8 epochs, tested after 2" in table and "| linear | 0 of 0 |" in table
    assert kill_after(parted / "chance.checkpoint.npz", 4, words(data, parted, 1)) == -signal.SIGKILL
    assert read_progress(parted / "chance.checkpoint.npz").epoch >= 4
    assert main(words(data, parted, 1)) == 0 and results(parted) == results(whole)
    assert "- nothing" in (parted / "experiments.md").read_text("utf-8")


def test_what_cannot_run_is_one_line(data, tmp_path, capsys):
    assert main(["--data", str(tmp_path), "--out", str(tmp_path / "out"), "--hours", "1"]) == 0
    assert "skipped" in capsys.readouterr().out and not (tmp_path / "out").exists()
    (tmp_path / "file").write_text("")
    damaged = [tmp_path / "rows.json", tmp_path / "config.json"]
    for path, rows in zip(damaged, ([], {"one": {"title": "one", "config": []}})):
        source = {"folder": "people", "subjects": []}
        path.write_text(json.dumps({"action": "throw", "training": source, "tests": {"one": source}, "rows": rows}))
    for more in (["--row", "nobody"], ["--out", str(tmp_path / "file" / "out")], ["--hours", "nan"],
                 ["--experiments", str(data / "people" / "throws.csv")],
                 *(["--experiments", str(path)] for path in damaged)):
        assert main([*words(data, tmp_path / "out", 1), *more]) == 2
        assert capsys.readouterr().err.count("\n") == 1 and not (tmp_path / "out").exists()


def test_the_rows_are_those_of_the_thesis_and_ours():
    rows = read_experiments(EXPERIMENTS).rows
    single, six = rows["thesis-single"].config, rows["thesis-hierarchy"].config
    assert (single.settings.layers, single.settings.units, single.epochs) == (4, 512, 600)
    assert (six.settings.layers, six.settings.units, six.epochs, six.batch, six.keep) == (3, 256, 400, 32, 0.7)
    assert rows["gradient-ik"].config.settings.ik_layer and not rows["gradient"].config.settings.ik_layer
    assert not any(row.config.linear_start for name, row in rows.items() if name.startswith(("thesis", "chance")))


@pytest.mark.parametrize(("words", "status", "told"), [
    ("--help", 0, "--hours HOURS"),
    ("--data . --out out --hours 0 --experiments {}", 2, "the extra 'training'"),
])
def test_without_jax_there_is_help_and_one_line(words, status, told, tmp_path, data):
    code = "import sys; sys.modules['jax'] = None; from training.experiments import main; sys.exit(main(sys.argv[1:]))"
    command = words.format(data / "rows.json").replace("--data .", f"--data {data}").split()
    ran = subprocess.run([sys.executable, "-c", code, *command], cwd=TOP, capture_output=True, text=True)
    assert ran.returncode == status and told in ran.stdout + ran.stderr and ran.stderr.count("\n") <= 1
