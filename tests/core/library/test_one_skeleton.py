"""Many bodies on one skeleton, by the library and by the `retarget` command: rate, floor, names, feet."""

import json
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.cli.main import main
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.common_skeleton import retarget_clip, unify_skeletons
from beyond_mocap.library.repair import measure_slide
from beyond_mocap.motion import contacts, quaternion
from beyond_mocap.motion.humanoid import measure_leg_length
from beyond_mocap.motion.motion import Motion, forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.synthetic.gait import build_gait


def legs_longer(factor: float):
    skeleton = build_adult_skeleton(1.7)
    offsets = skeleton.offsets.copy()
    for name in ("LeftLeg", "RightLeg"):
        offsets[skeleton.index(name)] *= factor
    return replace(skeleton, offsets=offsets, names=tuple(f"mixamorig:{name}" for name in skeleton.names))


@pytest.fixture(scope="module")
def walk() -> Motion:
    return build_gait(1.5, 3.0, 60.0, seed=4)


@pytest.fixture(scope="module")
def other() -> Motion:
    return build_gait(2.5, 2.0, 30.0, legs_longer(1.1))


def test_feet_stand_and_the_floor_stays_on_other_legs(walk, other):
    there = retarget_clip(walk, other)
    assert there.fps == walk.fps and len(there) == len(walk) and there.skeleton is other.skeleton
    assert measure_slide(there, contacts.detect_heel_toe_contacts(walk)) < measure_slide(walk,
            contacts.detect_heel_toe_contacts(walk)) + 0.01
    assert abs(contacts.measure_floor_height(there) - contacts.measure_floor_height(walk)) < 0.015
    scale = measure_leg_length(other.skeleton) / measure_leg_length(walk.skeleton)
    travelled = [np.linalg.norm(m.root_positions[-1] - m.root_positions[0]) for m in (walk, there)]
    assert abs(travelled[1] / travelled[0] - scale) < 0.02


def test_a_lifted_motion_stays_lifted(walk, other):
    lifted = replace(walk, root_positions=walk.root_positions + [0.0, 0.0, 2.0])
    off = retarget_clip(lifted, other).root_positions - retarget_clip(walk, other).root_positions
    assert np.allclose(off, [0.0, 0.0, 2.0], atol=1e-6)


def test_on_its_own_skeleton_a_motion_stays(walk):
    there = retarget_clip(walk, build_gait(3.0, 1.0, 30.0))
    assert np.abs(forward_kinematics(there)[0] - forward_kinematics(walk)[0]).max() < 1e-9


def test_a_single_pose_is_enough_of_a_target(walk, other):
    there = retarget_clip(walk, other.frames(0, 1))
    full = retarget_clip(walk, other)
    assert np.abs(forward_kinematics(there)[0] - forward_kinematics(full)[0]).max() < 0.2


def test_most_frames_choose_the_skeleton_unless_told(walk, other, tmp_path):
    paths, notes = [tmp_path / "a.bvh", tmp_path / "b.bvh"], []
    brought = list(unify_skeletons(paths, [other, walk], None, notes))
    assert [(motion.skeleton is walk.skeleton, moved) for motion, _, moved in brought] == [(True, True), (True, False)]
    assert [motion.fps for motion, _, _ in brought] == [30.0, 60.0]
    assert notes == ["1 clip of 1 other skeleton retargeted to the one with 22 joints"]
    brought = list(unify_skeletons(paths, [other, walk], other, []))
    assert [motion.skeleton.names == other.skeleton.names for motion, _, _ in brought] == [True, True]
    assert brought[1][1].shape == (len(walk), 2, 2)


def test_the_command_writes_the_targets_names_at_the_inputs_rate(walk, other, tmp_path, capsys):
    bvh.write_bvh(tmp_path / "in.bvh", walk)
    bvh.write_bvh(tmp_path / "to.bvh", other)
    out = tmp_path / "out.bvh"
    assert main(["retarget", str(tmp_path / "in.bvh"), "--to", str(tmp_path / "to.bvh"), "--out", str(out)]) == 0
    told = capsys.readouterr()
    assert str(out) in told.out and "unit 0.01 m (estimated)" in told.err
    wrote, target = bvh.read_bvh(out), bvh.read_bvh(tmp_path / "to.bvh")
    assert wrote.motion.skeleton.names == target.motion.skeleton.names
    assert wrote.form.channels == target.form.channels
    assert wrote.motion.fps == 60.0 and len(wrote.motion) == len(walk)
    assert np.allclose(wrote.motion.skeleton.offsets, target.motion.skeleton.offsets, atol=1e-5)


@pytest.mark.parametrize("table, found", [({"Hip": "Hips"}, "no joint 'Hip'"), (None, "no such file")])
def test_the_command_tells_bad_maps_in_one_line(walk, tmp_path, capsys, table, found):
    bvh.write_bvh(tmp_path / "in.bvh", walk)
    if table:
        (tmp_path / "map.json").write_text(json.dumps(table))
    files = [str(tmp_path / "in.bvh"), "--to", str(tmp_path / "in.bvh"), "--out", str(tmp_path / "out.bvh")]
    assert main(["retarget", *files, "--map", str(tmp_path / "map.json")]) == 2
    told = capsys.readouterr().err.strip()
    assert "\n" not in told and "map.json" in told and found in told
    assert not (tmp_path / "out.bvh").exists()


def test_the_command_tells_bodies_without_legs_and_keeps_its_inputs(walk, tmp_path, capsys):
    stick = Skeleton(("root", "top"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    bvh.write_bvh(tmp_path / "stick.bvh", Motion(stick, np.zeros((4, 3)), quaternion.identity(4, 2), 30.0))
    bvh.write_bvh(tmp_path / "in.bvh", walk)
    names = {name: str(tmp_path / f"{name}.bvh") for name in ("in", "stick", "out")}
    for one, other in (("in", "stick"), ("stick", "in")):
        assert main(["retarget", names[one], "--to", names[other], "--out", names["out"]]) == 2
        told = capsys.readouterr().err.strip()
        assert "\n" not in told and told.startswith(f"beyond-mocap: {names['stick']}: skeleton: no joint found")
    assert main(["retarget", names["in"], "--to", names["in"], "--out", names["in"]]) == 2
