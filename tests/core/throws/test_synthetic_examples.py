"""Folders of made throws and kicks: what the table says is what the recordings do."""

import csv

import numpy as np
import pytest

from beyond_mocap.annotation import read_clip_annotations
from beyond_mocap.ball.flight import find_wall_impact
from beyond_mocap.ball.physics import BASEBALL
from beyond_mocap.base.errors import InputError, UserCancelledError
from beyond_mocap.cli.main import main
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.throws.synthetic_examples import generate_example, write_examples


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("planted") / "throws"
    assert main(["throw", "examples", "--out", str(out), "--subjects", "2", "--throws", "2", "--seed", "3"]) == 0
    return out


def rows(folder):
    with open(folder / "throws.csv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_every_recording_has_its_row_and_its_words(folder):
    table = rows(folder)
    assert [row["subject"] for row in table] == ["subject03"] * 2 + ["subject04"] * 2
    for row in table:
        clip = folder / row["file"]
        words = read_clip_annotations(clip.with_suffix(".txt"), 120.0)
        assert len(words) == 1 and "throwb" in words[0].words
        assert abs(words[0].key / 120.0 - float(row["release_s"])) <= 0.5 / 120.0


def test_the_ball_leaves_near_the_hand_and_flies_through_the_impact(folder):
    for row in rows(folder):
        motion = bvh.read_bvh(folder / row["file"]).motion
        places, _ = forward_kinematics(motion)
        frame = int(round(float(row["release_s"]) * motion.fps))
        hand = places[frame, identify_joints(motion.skeleton).right.hand]
        launch = np.array([float(row[f"launch_{axis}_m_s"]) for axis in "xyz"])
        impact = np.array([float(row[f"target_{axis}_m"]) for axis in "xyz"])
        assert abs(np.linalg.norm(launch) - float(row["speed_m_s"])) < 1e-4
        ahead = launch[:2] / np.linalg.norm(launch[:2])
        place, _ = find_wall_impact(hand, launch, BASEBALL, impact[:2], ahead)
        assert np.linalg.norm(place - impact) < 0.5  # the ball lies in the fingers, not in the wrist


def test_the_same_seed_and_number_make_the_same_throw():
    (name, made), (_, again), (_, other) = (generate_example("throw", 7, order) for order in (1, 1, 2))
    assert name == "subject07"
    assert np.array_equal(made.motion.rotations, again.motion.rotations)
    assert np.array_equal(made.impact, again.impact) and not np.array_equal(made.impact, other.impact)


def test_a_folder_in_use_is_left_alone(folder, capsys):
    before = sorted(folder.rglob("*"))
    assert main(["throw", "examples", "--out", str(folder)]) == 2
    assert "not empty" in capsys.readouterr().err and sorted(folder.rglob("*")) == before


def test_an_unknown_action_and_cancelling(tmp_path):
    with pytest.raises(InputError, match="throw"):
        write_examples(tmp_path, "header", 1, 1)
    asked = iter((False, True))
    with pytest.raises(UserCancelledError):
        write_examples(tmp_path / "new", "throw", 1, 2, cancelled=lambda: next(asked))
    assert not list(tmp_path.iterdir())


def test_a_folder_comes_whole_or_not_at_all(tmp_path, monkeypatch):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match="mine.txt: is a file"):
        write_examples(tmp_path / "mine.txt", "throw", 1, 1)
    with pytest.raises(InputError, match="cannot be written"):
        write_examples(tmp_path / "mine.txt" / "new", "throw", 1, 1)
    monkeypatch.setattr(bvh, "write_bvh", full)
    with pytest.raises(InputError, match="^[^ ]*/new/adult/adult_throw001.bvh: cannot be written .No space"):
        write_examples(tmp_path / "new", "throw", 1, 1)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def full(path, motion):
    raise InputError(path, "cannot be written (No space left on device)", "a folder that can be written")


def test_an_empty_folder_is_filled_by_one_run(tmp_path):
    assert write_examples(tmp_path / "a" / "new", "throw", 1, 1) == 1
    (tmp_path / "empty").mkdir()

    def other(share, text):  # a second run into the same folder
        with pytest.raises(InputError, match="not empty"):
            write_examples(tmp_path / "empty", "throw", 1, 1)

    assert write_examples(tmp_path / "empty", "throw", 1, 1, progress=other) == 1
    for place in (tmp_path / "a" / "new", tmp_path / "empty"):
        assert sorted(path.name for path in place.iterdir()) == ["adult", "throws.csv"]
    with pytest.raises(UserCancelledError):
        write_examples(tmp_path / "a" / "other", "throw", 1, 1, cancelled=lambda: True)
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["new"]
