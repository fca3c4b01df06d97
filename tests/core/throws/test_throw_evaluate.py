"""`throw evaluate`: a model on a folder, as report and page; what is wrong is one line and nothing is written."""

import json

import pytest

from beyond_mocap.cli.main import main
from beyond_mocap.throws.network_npz import write_model
from beyond_mocap.throws.synthetic_examples import write_examples
from tests.core.linear_throws import build_linear_model, build_throw_examples


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A model and a folder with a throw of each of two people."""
    folder = tmp_path_factory.mktemp("evaluate")
    write_model(build_linear_model(build_throw_examples(4), ridge=100.0), folder / "w.npz")
    write_examples(folder / "throws", "throw", 2, 1, 5)
    return folder


def call(place, *more, folder="throws", model="w.npz"):
    return main(["throw", "evaluate", "--model", str(place / model), "--examples", str(place / folder),
                 "--report", str(place / "r.json"), *more])  # fmt: skip


def test_a_folder_is_measured(place, capfd):
    assert call(place, "--html", str(place / "r.html")) == 0
    report = json.loads((place / "r.json").read_text("utf-8"))
    assert report["motions"] == 2 and len(report["subjects"]) == 2 and report["left_out"] == []
    assert all(value < 0.1 for value in report["deviation_m"].values())
    page = (place / "r.html").read_text("utf-8")
    assert page.startswith("<!DOCTYPE html>") and all(name in page for name in report["subjects"])
    assert call(place, "--raw", "--subject", report["subjects"][1], "--motions", "1") == 0
    raw = json.loads((place / "r.json").read_text("utf-8"))
    assert raw["motions"] == 1 and not raw["options"]["ik"] and raw["deviation_m"] == raw["network_deviation_m"]


def test_the_same_figures_twice(place):
    both = []
    for _ in range(2):
        assert call(place, "--raw", "--motions", "1") == 0
        report = json.loads((place / "r.json").read_text("utf-8"))
        both.append([(one["name"], one["deviation"], one["impact"]) for one in report["each"]])
    assert both[0] == both[1]


@pytest.mark.parametrize("more, words", [
    ({"folder": "nowhere"}, "nowhere"), ({"model": "recordet"}, "'recorded'"),
    ({"model": "throws/throws.csv"}, "throws.csv"),
    ({"more": ("--subject", "nobody")}, "nobody"), ({"more": ("--html", "THERE/no/r.html")}, "r.html"),
    ({"more": ("--html", "THERE/throws/throws.csv")}, "another file"),
])
def test_what_is_wrong_is_one_line(place, capfd, more, words):
    extra = [word.replace("THERE", str(place)) for word in more.pop("more", ())]
    (place / "r.json").unlink(missing_ok=True)
    assert call(place, *extra, **more) == 2
    told = capfd.readouterr().err.strip().splitlines()
    assert words in told[-1] and "Traceback" not in "".join(told) and not (place / "r.json").exists()
