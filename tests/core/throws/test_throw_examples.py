"""Folders read as examples: planted throws come back as they were planted, and what nobody wrote down is found."""

import json
import shutil
import tempfile
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion, forward_kinematics, place_motion
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.throws.synthetic_examples import COLUMNS, generate_example, write_examples
from beyond_mocap.throws.throw_examples import read_examples

HEAD = ",".join(COLUMNS[:11])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("planted") / "throws"
    write_examples(out, "throw", 2, 1, seed=3)
    return out


@pytest.fixture()
def own(folder, tmp_path):
    return shutil.copytree(folder, tmp_path / "throws")


def clip(folder, who="subject03"):
    return folder / who / f"{who}_throw001.bvh"


def test_planted_throws_come_back(folder):
    found = read_examples(folder, "throw", 60.0)
    assert [example.subject for example in found] == ["subject03", "subject04"]
    for seed, example in zip((3, 4), found):
        _, truth = generate_example("throw", seed, 0)
        assert example.limb == 1 and example.motion.fps == 60.0
        assert abs(example.impact[1]) < 1e-9 and abs(example.impact[2] - truth.impact[2]) < 1e-4
        assert abs(np.linalg.norm(example.launch) - np.linalg.norm(truth.velocity)) < 1e-3
        places, _ = forward_kinematics(example.motion)
        body = identify_joints(example.motion.skeleton)
        assert np.abs(places[0, body.hips, :2]).max() < 1e-6
        hand = np.array(
            [np.interp(example.release, np.arange(len(places)), way) for way in places[:, body.right.hand].T]
        )
        away = np.hypot(*(example.impact - hand)[:2])
        assert abs(away - np.hypot(*(truth.impact - truth.position)[:2])) < 0.25  # the ball is in the fingers


def test_what_only_annotations_tell(own):
    (own / "throws.csv").unlink()
    for seed, example in zip((3, 4), read_examples(own)):
        _, truth = generate_example("throw", seed, 0)
        assert example.limb == 1 and example.subject == f"subject{seed:02d}"
        speed = np.linalg.norm(truth.velocity)
        assert abs(np.linalg.norm(example.launch) - speed) < 0.1 * speed
        assert 2.0 < example.impact[0] < 6.0  # the wall stands 4 m ahead of the hand


def test_the_hand_is_found_where_no_word_names_it(own):
    (own / "throws.csv").unlink()
    words = clip(own).with_suffix(".txt")
    words.write_text(words.read_text().replace(" right", ""))
    assert [example.limb for example in read_examples(own)] == [1, 1]


def test_the_place_in_the_world_changes_nothing(own):
    before = read_examples(own)[0]
    moved = clip(own)
    motion = bvh.read_bvh(moved).motion
    bvh.write_bvh(moved, place_motion(motion, 2.0, (7.0, -3.0, 0.0)))
    table = (own / "throws.csv").read_text().splitlines()
    cells = table[1].split(",")
    turn = quaternion.from_up_angle(np.array(2.0))
    target, launch = (quaternion.rotate(turn, np.array(cells[a:b], float)) for a, b in ((4, 7), (8, 11)))
    cells[4:7], cells[8:11] = map(str, target + [7.0, -3.0, 0.0]), map(str, launch)
    (own / "throws.csv").write_text("\n".join([table[0], ",".join(cells), *table[2:]]))
    after = read_examples(own)[0]
    assert np.allclose(after.impact, before.impact, atol=1e-4) and np.allclose(after.launch, before.launch, atol=1e-4)
    ways = [forward_kinematics(example.motion)[0] for example in (before, after)]
    assert np.abs(ways[0] - ways[1]).max() < 1e-3


def test_a_floor_elsewhere_is_brought_to_zero(own):
    before = read_examples(own)[0]
    motion = bvh.read_bvh(clip(own)).motion
    bvh.write_bvh(clip(own), place_motion(motion, 0.0, (0.0, 0.0, 0.5)))
    after = read_examples(own)[0]
    assert np.abs(after.motion.root_positions - before.motion.root_positions).max() < 0.03


def test_mirrored_copies_are_thrown_with_the_other_hand(folder):
    first, other = read_examples(folder, mirror=True)[:2]
    assert (first.limb, other.limb) == (1, 0) and "mirrored" in other.name
    assert np.allclose(other.launch, first.launch * [1, -1, 1])


def test_all_on_one_skeleton(folder):
    target = bvh.read_bvh(clip(folder)).motion
    own = read_examples(folder)[1]
    there = read_examples(folder, target=target)[1]
    assert there.motion.skeleton.has_same_bones(target.skeleton)
    assert np.allclose(np.linalg.norm(there.launch), np.linalg.norm(own.launch), atol=0.5)


def split_joint(motion: Motion, name: str) -> Motion:
    """The same motion with another joint, which never turns, 1 cm above the joint `name`: its children hang there."""
    skeleton = motion.skeleton
    at = skeleton.names.index(name) + 1
    offsets = np.insert(skeleton.offsets, at, [0.0, 0.0, 0.01], axis=0)
    parents = [parent + (parent >= at) for parent in skeleton.parents]
    parents = [at if parent == at - 1 else parent for parent in parents]
    other = Skeleton((*skeleton.names[:at], f"{name}Split", *skeleton.names[at:]),
                     (*parents[:at], at - 1, *parents[at:]), offsets)
    rotations = np.insert(motion.rotations, at, [1.0, 0.0, 0.0, 0.0], axis=1)
    return Motion(other, motion.root_positions, rotations, motion.fps)


def test_another_rig_holds_head_and_hands_as_recorded(own):
    target = read_examples(own)[0].motion
    for path in sorted(own.rglob("*.bvh")):
        bvh.write_bvh(path, split_joint(split_joint(bvh.read_bvh(path).motion, "Spine"), "Neck"))
    there, plain = read_examples(own, target=target)[0].motion, target
    body = identify_joints(target.skeleton)
    for joint in (body.head, body.right.hand, body.left.hand):
        off = quaternion.multiply(quaternion.inverse(forward_kinematics(plain)[1][:, joint]),
                                  forward_kinematics(there)[1][:, joint])
        assert np.degrees(np.median(np.linalg.norm(quaternion.to_rotation_vector(off), axis=1))) < 6.0


def test_the_report_of_a_release_beside_it(own):
    (own / "throws.csv").unlink()
    clip(own).with_suffix(".txt").unlink()
    _, truth = generate_example("throw", 3, 0)
    speed = float(np.linalg.norm(truth.velocity))
    report = {"release_time_s": truth.release, "speed_m_s": speed, "direction": (truth.velocity / speed).tolist(),
              "hand": "right", "impact_m": truth.impact.tolist()}
    beside = clip(own).with_suffix(".release.json")
    beside.write_text(json.dumps(report))
    first = read_examples(own)[0]
    assert abs(first.impact[2] - truth.impact[2]) < 1e-4 and abs(np.linalg.norm(first.launch) - speed) < 1e-6
    wrong = [json.dumps(report | {"impact_m": impact}) for impact in (["a", 2, None], [np.nan, 2, 3])]
    for text in ("{}", "[" * 100000, *wrong):
        beside.write_text(text)
        told = []
        assert len(read_examples(own, report=told.append)) == 1 and "not a release report" in told[0]


def test_odd_recordings_are_told_and_left_out(own):
    table = (own / "throws.csv").read_text().splitlines()
    late = table[1].split(",")
    late[3] = "99"
    (own / "throws.csv").write_text("\n".join([table[0], ",".join(late), *table[2:]]))
    shutil.copy(clip(own), own / "walk.bvh")
    told = []
    assert len(read_examples(own, report=told.append)) == 1
    assert any("99" in line for line in told) and any("1 of 3" in line and "walk.bvh" in line for line in told)


@pytest.mark.parametrize(
    "change", [("limb", "nose"), ("release_s", "soon"), ("target_x_m", ""), ("file", "subject03/none.bvh"),
               ("file", "subject03/../subject03/subject03_throw001.bvh"), ("speed_m_s", "0"), ("speed_m_s", "-5"),
               ("speed_m_s", "nan"),
               ("speed_m_s", "1e9"), ("launch_x_m_s", "1e12"), ("launch_x_m_s", "inf"), ("launch_y_m_s", "1e308")],
)
def test_a_wrong_table_is_told_with_its_line(own, change):
    path = own / "throws.csv"
    table = path.read_text().splitlines()
    cells = dict(zip(table[0].split(","), table[1].split(",")))
    cells[change[0]] = change[1]
    path.write_text("\n".join([table[0], ",".join(cells.values()), *table[2:]]))
    with pytest.raises(InputError, match="throws.csv:2"):
        read_examples(own)


@pytest.mark.parametrize("target, said", [
    ((9000.0, 0.0, 1.0), "200 m"), ((0.0, 0.0, -40.0), "below the floor"), (None, "behind the ball"),
    ((0.1, 0.1, 0.1), "0.5"),
])
def test_a_target_that_no_ball_flies_through_leaves_its_throw_out(own, target, said):
    path = own / "throws.csv"
    table = path.read_text().splitlines()
    cells = dict(zip(table[0].split(","), table[1].split(",")))
    ball, way, there = (np.array([float(cells[f"{name}_{axis}_m{unit}"]) for axis in "xyz"])
                        for name, unit in (("ball", ""), ("launch", "_s"), ("target", "")))  # fmt: skip
    there = ball - [*way[:2], 0.0] if target is None else there + target if said != "0.5" else ball + target
    cells |= {f"target_{axis}_m": f"{value:.6f}" for axis, value in zip("xyz", there)}
    path.write_text("\n".join([table[0], ",".join(cells.values()), *table[2:]]))
    told = []
    assert len(read_examples(own, report=told.append)) == 1 and "target" in told[0] and said in told[0]


def test_annotations_of_what_is_not_there_are_told(own):
    (own / "annotations.csv").write_text(
        "file,start_frame,end_frame,key_frame,labels\nnobody.bvh,0,300,100,throwb right\n"
    )
    told = []
    assert len(read_examples(own, report=told.append)) == 2
    assert len(told) == 1 and "annotations.csv: names 1" in told[0] and "nobody.bvh" in told[0]


def test_folders_without_examples(own, tmp_path):
    with pytest.raises(InputError, match="none with a kick, 2 with a throw.*the model for a throw"):
        read_examples(own, "kick")
    for order in (1, 2):
        clip(own, f"subject{order + 2:02d}").write_text("HIERARCHY")
    with pytest.raises(InputError, match="every throw in it is left out"):
        read_examples(own)
    with pytest.raises(InputError, match="no such folder"):
        read_examples(tmp_path / "nowhere")


def test_a_skeleton_without_hands_is_refused_before_anything_is_read(own):
    legs = Skeleton(("Hips", "LeftUpLeg", "LeftLeg", "LeftFoot", "RightUpLeg", "RightLeg", "RightFoot"),
                    (-1, 0, 1, 2, 0, 4, 5), [[0, 0, 0], *[[0, 0.1, 0], [0, 0, -0.4], [0, 0, -0.4]] * 2])  # fmt: skip
    told, still = [], np.tile([1.0, 0.0, 0.0, 0.0], (1, 7, 1))
    with pytest.raises(InputError, match="^skeleton: no"):
        read_examples(own, target=Motion(legs, np.zeros((1, 3)), still, 30.0), report=told.append)
    assert not told


# Cells of every kind below the header as it is, and any text in its place.
CELLS = st.one_of(st.floats().map(str), st.integers().map(str), st.text(max_size=6),
                  st.sampled_from(["", "right_hand", "left_foot", "throw.bvh", "1e400", "-0", "nan"]))  # fmt: skip


@settings(max_examples=60, deadline=None)
@given(st.one_of(
    st.lists(st.lists(CELLS, min_size=11, max_size=11),
             max_size=3).map(lambda rows: "\n".join([HEAD, *map(",".join, rows)])),
    st.lists(st.tuples(*[st.floats(allow_nan=False).map(str) for _ in range(8)]), min_size=1, max_size=2).map(
        lambda rows: "\n".join([HEAD, *("throw.bvh,me,right_hand," + ",".join(row) for row in rows)])),
    st.text(max_size=60),
))
def test_any_table_is_read_or_told_in_one_line(table):
    with tempfile.TemporaryDirectory() as place:
        Path(place, "throw.bvh").write_bytes(recording())
        Path(place, "throws.csv").write_text(table, "utf-8")
        told = []
        try:
            for example in read_examples(place, report=told.append):
                assert np.isfinite(example.impact).all() and np.isfinite(example.launch).all()
        except InputError as error:
            told.append(str(error))
        assert all(len(line.splitlines()) == 1 for line in told)


@lru_cache
def recording() -> bytes:
    with tempfile.TemporaryDirectory() as place:
        bvh.write_bvh(Path(place, "throw.bvh"), generate_example("throw", 3, 0)[1].motion)
        return Path(place, "throw.bvh").read_bytes()


def test_kicks_come_back_by_the_table_and_by_the_foot_alone(tmp_path):
    out = tmp_path / "kicks"
    write_examples(out, "kick", 1, 1, seed=3)
    _, truth = generate_example("kick", 3, 0)
    told = read_examples(out, "kick")[0]
    assert told.limb == 3 and abs(told.impact[2] - truth.impact[2]) < 1e-4
    (out / "throws.csv").unlink()
    found = read_examples(out, "kick")[0]
    assert found.limb == 3 and abs(found.release - told.release) <= 0.03 * 30.0 + 0.5
    assert abs(np.linalg.norm(found.launch) / np.linalg.norm(truth.velocity) - 1.0) < 0.25
    assert found.impact[2] >= 0.1


def test_a_broken_recording_is_left_out(own):
    clip(own).write_text("HIERARCHY\nROOT")
    told = []
    assert len(read_examples(own, report=told.append)) == 1 and "subject03_throw001.bvh" in told[0]
