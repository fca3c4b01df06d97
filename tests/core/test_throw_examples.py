"""Folders read as examples: planted throws come back as they were planted, and what nobody wrote down is found."""

import json
import shutil

import numpy as np
import pytest

from beyond_mocap.errors import InputError
from beyond_mocap.files import bvh
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify
from beyond_mocap.motion.motion import forward_kinematics, place
from beyond_mocap.planted_examples import planted, write_planted
from beyond_mocap.throw_examples import examples_in


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("planted") / "throws"
    write_planted(out, "throw", 2, 1, seed=3)
    return out


@pytest.fixture()
def own(folder, tmp_path):
    return shutil.copytree(folder, tmp_path / "throws")


def clip(folder, who="subject03"):
    return folder / who / f"{who}_throw001.bvh"


def test_planted_throws_come_back(folder):
    found = examples_in(folder, "throw", 60.0)
    assert [example.subject for example in found] == ["subject03", "subject04"]
    for seed, example in zip((3, 4), found):
        _, truth = planted("throw", seed, 0)
        assert example.limb == 1 and example.motion.fps == 60.0
        assert abs(example.impact[1]) < 1e-9 and abs(example.impact[2] - truth.impact[2]) < 1e-4
        assert abs(np.linalg.norm(example.launch) - np.linalg.norm(truth.velocity)) < 1e-3
        places, _ = forward_kinematics(example.motion)
        body = identify(example.motion.skeleton)
        assert np.abs(places[0, body.hips, :2]).max() < 1e-6
        hand = np.array([np.interp(example.release, np.arange(len(places)), way) for way in places[:, body.right.hand].T])
        away = np.hypot(*(example.impact - hand)[:2])
        assert abs(away - np.hypot(*(truth.impact - truth.position)[:2])) < 0.25  # the ball is in the fingers


def test_what_only_annotations_tell(own):
    (own / "throws.csv").unlink()
    for seed, example in zip((3, 4), examples_in(own)):
        _, truth = planted("throw", seed, 0)
        assert example.limb == 1 and example.subject == f"subject{seed:02d}"
        speed = np.linalg.norm(truth.velocity)
        assert abs(np.linalg.norm(example.launch) - speed) < 0.1 * speed
        assert 2.0 < example.impact[0] < 6.0  # the wall stands 4 m ahead of the hand


def test_the_hand_is_found_where_no_word_names_it(own):
    (own / "throws.csv").unlink()
    words = clip(own).with_suffix(".txt")
    words.write_text(words.read_text().replace(" right", ""))
    assert [example.limb for example in examples_in(own)] == [1, 1]


def test_the_place_in_the_world_changes_nothing(own):
    before = examples_in(own)[0]
    moved = clip(own)
    motion = bvh.read(moved).motion
    bvh.write(moved, place(motion, 2.0, (7.0, -3.0, 0.0)))
    table = (own / "throws.csv").read_text().splitlines()
    cells = table[1].split(",")
    turn = quaternion.about_up(np.array(2.0))
    target, launch = (quaternion.rotate(turn, np.array(cells[a:b], float)) for a, b in ((4, 7), (8, 11)))
    cells[4:7], cells[8:11] = map(str, target + [7.0, -3.0, 0.0]), map(str, launch)
    (own / "throws.csv").write_text("\n".join([table[0], ",".join(cells), *table[2:]]))
    after = examples_in(own)[0]
    assert np.allclose(after.impact, before.impact, atol=1e-4) and np.allclose(after.launch, before.launch, atol=1e-4)
    ways = [forward_kinematics(example.motion)[0] for example in (before, after)]
    assert np.abs(ways[0] - ways[1]).max() < 1e-3


def test_a_floor_elsewhere_is_brought_to_zero(own):
    before = examples_in(own)[0]
    motion = bvh.read(clip(own)).motion
    bvh.write(clip(own), place(motion, 0.0, (0.0, 0.0, 0.5)))
    after = examples_in(own)[0]
    assert np.abs(after.motion.root_positions - before.motion.root_positions).max() < 0.03


def test_mirrored_copies_are_thrown_with_the_other_hand(folder):
    first, other = examples_in(folder, mirror=True)[:2]
    assert (first.limb, other.limb) == (1, 0) and "mirrored" in other.name
    assert np.allclose(other.launch, first.launch * [1, -1, 1])


def test_all_on_one_skeleton(folder):
    skeleton = bvh.read(clip(folder)).motion.skeleton
    own = examples_in(folder)[1]
    there = examples_in(folder, skeleton=skeleton)[1]
    assert there.motion.skeleton.same_bones(skeleton)
    assert np.allclose(np.linalg.norm(there.launch), np.linalg.norm(own.launch), atol=0.5)


def test_the_report_of_a_release_beside_it(own):
    (own / "throws.csv").unlink()
    clip(own).with_suffix(".txt").unlink()
    _, truth = planted("throw", 3, 0)
    speed = float(np.linalg.norm(truth.velocity))
    report = {"release_time_s": truth.release, "speed_m_s": speed, "direction": (truth.velocity / speed).tolist(),
              "hand": "right", "impact_m": truth.impact.tolist()}
    beside = clip(own).with_suffix(".release.json")
    beside.write_text(json.dumps(report))
    first = examples_in(own)[0]
    assert abs(first.impact[2] - truth.impact[2]) < 1e-4 and abs(np.linalg.norm(first.launch) - speed) < 1e-6
    wrong = [json.dumps(report | {"impact_m": impact}) for impact in (["a", 2, None], [np.nan, 2, 3])]
    for text in ("{}", "[" * 100000, *wrong):
        beside.write_text(text)
        told = []
        assert len(examples_in(own, told=told.append)) == 1 and "no report of a release" in told[0]


def test_odd_recordings_are_told_and_left_out(own):
    table = (own / "throws.csv").read_text().splitlines()
    late = table[1].split(",")
    late[3] = "99"
    (own / "throws.csv").write_text("\n".join([table[0], ",".join(late), *table[2:]]))
    shutil.copy(clip(own), own / "walk.bvh")
    told = []
    assert len(examples_in(own, told=told.append)) == 1
    assert any("99" in line for line in told) and any(line.startswith("walk.bvh") for line in told)


@pytest.mark.parametrize(
    "change", [("limb", "nose"), ("release_s", "soon"), ("target_x_m", ""), ("file", "subject03/none.bvh"),
     ("file", "subject03/../subject03/subject03_throw001.bvh")],
)
def test_a_wrong_table_is_told_with_its_line(own, change):
    path = own / "throws.csv"
    table = path.read_text().splitlines()
    cells = dict(zip(table[0].split(","), table[1].split(",")))
    cells[change[0]] = change[1]
    path.write_text("\n".join([table[0], ",".join(cells.values()), *table[2:]]))
    with pytest.raises(InputError, match="throws.csv:2"):
        examples_in(own)


def test_folders_without_examples(own, tmp_path):
    with pytest.raises(InputError, match="kick"):
        examples_in(own, "kick")
    with pytest.raises(InputError, match="no such folder"):
        examples_in(tmp_path / "nowhere")


def test_kicks_come_back_by_the_table_and_by_the_foot_alone(tmp_path):
    out = tmp_path / "kicks"
    write_planted(out, "kick", 1, 1, seed=3)
    _, truth = planted("kick", 3, 0)
    told = examples_in(out, "kick")[0]
    assert told.limb == 3 and abs(told.impact[2] - truth.impact[2]) < 1e-4
    (out / "throws.csv").unlink()
    found = examples_in(out, "kick")[0]
    assert found.limb == 3 and abs(found.release - told.release) <= 0.03 * 30.0 + 0.5
    assert abs(np.linalg.norm(found.launch) / np.linalg.norm(truth.velocity) - 1.0) < 0.25
    assert found.impact[2] >= 0.1


def test_a_broken_recording_is_left_out(own):
    clip(own).write_text("HIERARCHY\nROOT")
    told = []
    assert len(examples_in(own, told=told.append)) == 1 and "subject03_throw001.bvh" in told[0]
