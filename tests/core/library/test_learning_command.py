"""`library --learn` and `--propose`: from the clips with words to a table for those without, which a library reads."""

import csv
import json
import shutil
from pathlib import Path

import pytest

from beyond_mocap.annotation import read_annotation_csv
from beyond_mocap.cli.main import main

SAMPLE = Path(__file__).resolve().parents[3] / "sample_blend" / "library"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three kicks and a jog with words, another kick and a walk without."""
    folder = tmp_path_factory.mktemp("library")
    for name in ("kick_low_inside", "kick_low_inside_slow", "kick_low_top", "jogging_2_9"):
        for ending in (".bvh", ".txt"):
            shutil.copy(SAMPLE / (name + ending), folder / (name + ending))
    (folder / "new").mkdir()
    shutil.copy(SAMPLE / "kick_low_top.bvh", folder / "new" / "one.bvh")
    shutil.copy(SAMPLE / "walking_1_2.bvh", folder / "new" / "two.bvh")
    return folder


@pytest.fixture(scope="module")
def model(folder):
    path = folder.parent / "model.npz"
    assert main(["library", str(folder), "--learn", str(path)]) == 0
    return path


def test_words_are_proposed_for_the_clips_without(folder, model, tmp_path, capsys):
    out = tmp_path / "proposed.csv"
    assert main(["library", str(folder), "--propose", str(out), "--learned", str(model)]) == 0
    assert "for 2 clips without labels" in capsys.readouterr().out
    rows = read_annotation_csv(out)
    assert set(rows) == {"new/one.bvh", "new/two.bvh"}
    (kick,) = [row for row in rows["new/one.bvh"] if row.key is not None]
    assert kick.words[:2] == ("kick", "right") and abs(kick.key - 156) <= 2
    assert all(row.key is None for row in rows["new/two.bvh"])
    sources = {row["labels"].split()[0]: row["source"] for row in csv.DictReader(out.open())}
    assert sources == {"kick": "learned", "walking": "rules", "jogging": "rules"}


def test_what_is_learned_is_told_and_used_at_once(folder, tmp_path, capsys):
    model, out = tmp_path / "m.npz", tmp_path / "p.csv"
    assert main(["library", str(folder), "--learn", str(model), "--propose", str(out), "--json"]) == 0
    told = capsys.readouterr()
    assert "learned from 4 clips" in told.out and "kick: 3 moments" in told.out
    assert all("progress" in json.loads(line) for line in told.err.splitlines())
    assert "learned" in out.read_text()


def test_proposals_are_no_examples_until_they_are_accepted(folder, tmp_path, capsys):
    home, out = tmp_path / "library", str(tmp_path / "m.npz")
    shutil.copytree(folder, home)
    table = home / "annotations.csv"
    head = "file,fps,start_frame,end_frame,key_frame,labels,confidence,source,why"
    learned = "new/one.bvh,120,125,185,156,kick right low,0.9,learned,similar to the examples"
    ruled = "new/two.bvh,120,0,60,,walking,0.8,rules,1.2 m/s"
    table.write_text(f"{head}\n{learned}\n{ruled}\n")
    assert main(["library", str(home), "--learn", out]) == 0
    told = capsys.readouterr()
    assert "learned from 4 clips" in told.out and "kick: 3 moments" in told.out
    (line,) = [line for line in told.err.splitlines() if line.startswith("note: ")]
    assert "2 proposed rows are not used until" in line
    table.write_text(f"{head}\n{learned.removesuffix('similar to the examples')}\n{ruled}\n")
    assert main(["library", str(home), "--learn", out]) == 0
    told = capsys.readouterr()
    assert "learned from 5 clips" in told.out and "kick: 4 moments" in told.out
    assert "1 proposed row is not used until" in told.err


def test_a_library_of_proposals_alone_has_nothing_to_learn_from(folder, tmp_path, capsys):
    shutil.copytree(folder / "new", tmp_path / "library")
    assert main(["library", str(folder), "--propose", str(tmp_path / "library" / "p.csv")]) == 0
    table = (tmp_path / "library" / "p.csv").rename(tmp_path / "library" / "annotations.csv")
    table.write_text(table.read_text().replace("new/", ""))
    assert main(["library", str(table.parent), "--learn", str(tmp_path / "m.npz")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "no clip with labels" in line and "until you accept" in line


def test_rules_alone_where_nothing_was_learned(folder, tmp_path):
    out = tmp_path / "p.csv"
    assert main(["library", str(folder), "--propose", str(out), "--least", "0.6"]) == 0
    assert "learned" not in out.read_text() and "kick right" in out.read_text()


@pytest.mark.parametrize("options, told", [
    (("--propose", "OUT/p.csv", "--learned", "OUT/none.npz"), "no such file"),
    (("--learn", "OUT/m.npz", "--learned", "OUT/none.npz"), "set with --learn"),
    (("--propose", "OUT/none/p.csv"), "its folder does not exist"),
    (("--propose", "OUT/p.csv", "--least", "2"), "a number from 0 to 1"),
    (("--least", "0.3", "--learned", "OUT/none.npz"), "--propose"),
])
def test_bad_input_is_one_line(folder, tmp_path, capsys, options, told):
    options = [part.replace("OUT", str(tmp_path)) for part in options]
    assert main(["library", str(folder), *options]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert told in line and list(tmp_path.iterdir()) == []


def test_a_table_of_words_is_never_lost(folder, tmp_path, capsys):
    shutil.copytree(folder / "new", tmp_path / "library")
    table = tmp_path / "library" / "annotations.csv"
    table.write_text("file,fps,start_frame,end_frame,key_frame,labels\ntwo.bvh,30,0,20,,walking\n")
    assert main(["library", str(table.parent), "--propose", str(table)]) == 2
    assert "would be lost" in capsys.readouterr().err and "two.bvh,30,0,20" in table.read_text()


@pytest.mark.parametrize("option", ["--learn", "--propose"])
def test_a_recording_without_legs_is_named(tmp_path, capsys, option):
    joints = "ROOT Hips { OFFSET 0 0 0 CHANNELS 3 Xposition Yposition Zposition End Site { OFFSET 0 9 0 } }"
    (tmp_path / "box.bvh").write_text(f"HIERARCHY\n{joints}\nMOTION\nFrames: 2\nFrame Time: 0.033\n0 90 0\n0 90 0\n")
    if option == "--learn":
        (tmp_path / "box.txt").write_text("0 0.03 kick")
    assert main(["library", str(tmp_path), option, str(tmp_path / "out"), "--unit", "0.01"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{tmp_path / 'box.bvh'}: " in line and "upper_leg" in line


def test_a_library_without_words_has_nothing_to_learn_from(folder, tmp_path, capsys):
    assert main(["library", str(folder / "new"), "--learn", str(tmp_path / "m.npz")]) == 2
    assert "no clip with labels" in capsys.readouterr().err
