"""Skeletal feeds: the same joints come back from each form; units, axes and names are told; damage ends in one line."""

import json
import pathlib

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.files.joints.joint_readers import read_joints
from beyond_mocap.files.joints.landmarks import LANDMARKS, identify_landmark
from beyond_mocap.files.smpl.smpl import write_smpl
from beyond_mocap.files.smpl.smpl_skeleton import JOINTS
from beyond_mocap.motion.motion import forward_kinematics
from tests.core.files.test_smpl import build_walk
from tests.core.joint_feeds import NAMES, sample_joints, write_cdf, write_fifa, write_hawkeye, write_table

SAMPLES = pathlib.Path(__file__).resolve().parents[3] / ".." / "shared" / "data" / "skeletal"
FPS = 50.0


@pytest.fixture(scope="module")
def people():
    joints = sample_joints(fps=FPS)
    return {"7": joints[:100], "9": joints[20:90] + (30.0, -5.0, 0.0)}


FORMS = {"cdf": lambda folder, people: write_cdf(folder / "skeletal.jsonl", people, FPS),
         "hawkeye": lambda folder, people: write_hawkeye(folder, people, FPS),
         "table": lambda folder, people: write_table(folder / "joints.csv", people, FPS),
         "fifa": lambda folder, people: write_fifa(folder / "points.npz", people)}


@pytest.mark.parametrize("form", FORMS)
def test_the_same_joints_come_back_from_each_form(form, people, tmp_path):
    feed = read_joints(FORMS[form](tmp_path, people))
    assert feed.fps == FPS and len(feed.people) == 2
    for person, (name, joints) in zip(feed.people, people.items()):
        assert person.id == name or form == "fifa"
        assert person.team == ("" if form == "fifa" else "home")
        assert person.times == pytest.approx(np.arange(len(joints)) / FPS, abs=1e-4)
        own = person.positions[:, [person.landmarks.index(landmark) for landmark in NAMES]]
        assert np.abs(own - joints).max() < 1e-5


@pytest.fixture
def smpl_people(tmp_path):
    """The same walk by two people, 20 m apart; the second is absent for a while."""
    walk = build_walk()
    write_smpl(tmp_path / "walk.npz", walk)
    with np.load(tmp_path / "walk.npz") as stored:
        poses, trans = stored["poses"], stored["trans"]
    absent = np.zeros((2, len(walk), 1), bool)
    absent[1, 150:200] = True
    parts = {"global_orient": poses[:, :3], "body_pose": poses[:, 3:], "transl": trans}
    arrays = {name: np.where(absent, np.nan, np.stack([part, part])) for name, part in parts.items()}
    arrays["transl"][1, :, 0] += 20.0
    return walk, absent[..., 0], arrays


@pytest.mark.parametrize("ending", ["", "s"])  # both spellings are in use
def test_people_of_smpl_have_joints_of_mean_proportions(ending, smpl_people, tmp_path):
    walk, absent, arrays = smpl_people
    arrays = {name if name == "transl" else name + ending: array for name, array in arrays.items()}
    np.savez(tmp_path / "people.npz", **arrays, betas=np.zeros((2, 10)), fps=np.array(walk.fps))
    feed = read_joints(tmp_path / "people.npz")
    assert feed.fps == walk.fps and [person.id for person in feed.people] == ["0", "1"]
    truth, _ = forward_kinematics(walk)
    floor = truth[:, JOINTS.index("left_foot"), 2].min() - 0.009 * 1.76  # what read_smpl takes for the ground
    for person, missing, aside in zip(feed.people, absent, (0.0, 20.0)):
        assert person.times == pytest.approx(np.flatnonzero(~missing) / walk.fps)
        wanted = truth[~missing][:, [JOINTS.index(landmark) for landmark in person.landmarks]] + (aside, 0.0, -floor)
        assert np.abs(person.positions - wanted).max() < 0.03
    assert "mean proportions" in " ".join(feed.notes)


@pytest.mark.parametrize(("change", "line"), [
    ({"body_pose": np.zeros((2, 240, 30))}, "shapes"), ({"fps": np.array(9000.0)}, "1 to 1000"),
    ({"transl": np.full((2, 240, 3), np.nan)}, "no person"), ({"body_pose": np.full((2, 240, 69), 30.0)}, "radians"),
    ({"transl": np.zeros((3, 240, 3))}, "shapes"),
    ({"global_orient": np.array([object()] * 3)}, "global_orient"),
])  # fmt: skip
def test_damaged_people_of_smpl_end_with_one_line(change, line, smpl_people, tmp_path):
    np.savez(tmp_path / "people.npz", **{**smpl_people[2], **change})
    with pytest.raises(InputError, match=line):
        read_joints(tmp_path / "people.npz")


def test_the_joints_of_one_person_of_smpl_are_a_clip(tmp_path):
    write_smpl(tmp_path / "walk.npz", build_walk(60))
    with pytest.raises(InputError, match="one person's motion of SMPL.*library"):
        read_joints(tmp_path / "walk.npz")


@pytest.mark.parametrize(("factor", "frames", "knee", "line"), [
    (0.0, 100, "knee", "at one place"), (1e200, 100, "knee", "numbers of 1e.09 and more; expected .* metres"),
    (1.0, 1, "knee", "joints in 1 frame, no person in two; expected .*; export a longer part"),
    (1.0, 100, "patella", "no left_knee, but left_patella, right_patella; .* rename them"),
])  # fmt: skip
def test_joints_of_no_body_are_told(factor, frames, knee, line, people, tmp_path):
    path = write_table(tmp_path / "a.csv", {"7": factor * people["7"][:frames]}, FPS)
    path.write_text(path.read_text().replace("knee", knee))
    with pytest.raises(InputError, match=line):
        read_joints(path)


@pytest.mark.parametrize(("rate", "line"), [(FPS / 1000.0, "milliseconds: divide them by 1000"), (1.0, "frame numbers"),
                                            (4000.0, "check that times are seconds")])
def test_times_of_another_unit_are_told(rate, line, people, tmp_path):
    with pytest.raises(InputError, match=f"frames per second; expected 5 to 400; .*{line}"):
        read_joints(write_table(tmp_path / "a.csv", {"7": people["7"]}, rate))


def test_common_data_without_times_says_which_version_is_read(people, tmp_path):
    path = write_cdf(tmp_path / "skeletal.jsonl", people, FPS)
    path.write_text(path.read_text().replace('"timestamp"', '"stamp"'))
    with pytest.raises(InputError, match="jsonl:1: no 'timestamp'; expected Common Data Format 0.2.3"):
        read_joints(path)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_tables_of_table_programs_are_read(encoding, people, tmp_path):
    path = write_table(tmp_path / "a.csv", {"Jörg": people["7"]}, FPS)
    path.write_text(path.read_text(), encoding)
    assert [person.id for person in read_joints(path).people] == ["Jörg"]


@pytest.mark.parametrize(("unit", "turn", "said"), [
    (0.01, np.eye(3), "centimetres"), (0.3048, np.eye(3), "feet"), (1.0, [[1, 0, 0], [0, 0, 1], [0, -1, 0]], "y taken"),
    (1.0, [[1, 0, 0], [0, -1, 0], [0, 0, -1]], "-z taken"), (0.001, [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], "x taken"),
])  # fmt: skip
def test_unit_and_axes_are_found_and_told(unit, turn, said, people, tmp_path):
    turned = {name: joints @ np.array(turn, dtype=float).T for name, joints in people.items()}
    feed = read_joints(write_table(tmp_path / "a.csv", turned, FPS, unit=unit))
    assert said in " ".join(feed.notes)
    own, truth = feed.people[0], people["7"]
    heights = own.positions[:, [own.landmarks.index(name) for name in NAMES], 2]
    assert np.abs(heights - truth[..., 2]).max() < 1e-3
    # a rotation, no mirror image: left stays left
    left, right = (own.positions[:, own.landmarks.index(f"{side}_shoulder")] for side in ("left", "right"))
    nose = own.positions[:, own.landmarks.index("nose")]
    assert np.mean(np.cross(left - right, (0.0, 0.0, 1.0)) * (nose - 0.5 * (left + right))) > 0.0


def test_wild_points_are_left_out(people, tmp_path):
    joints = people["7"].copy()
    joints[10, 4] += (31.0, 0.0, 0.0)
    feed = read_joints(write_table(tmp_path / "a.csv", {"7": joints}, FPS))
    assert "1 point farther than" in " ".join(feed.notes)
    assert np.isnan(feed.people[0].positions[10, feed.people[0].landmarks.index(NAMES[4])]).all()


@pytest.mark.parametrize(("name", "expected"), [
    ("lBigToe", "left_big_toe"), ("R_1STTOE", "right_big_toe"), ("elbow_right", "right_elbow"), ("midHip", "pelvis"),
    ("left_hip", "left_hip"), ("LeftShoulder", "left_shoulder"), ("R_CALC", "right_heel"), ("Nose", "nose"),
    ("torso", None), ("rThumb", "right_thumb"), ("L_5THFINGER", "left_pinky"), ("", None),
])  # fmt: skip
def test_names_of_joints(name, expected):
    assert identify_landmark(name) == expected
    assert expected is None or expected in LANDMARKS


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("damage", ["truncated", "emptied", "renamed"])
def test_damaged_feeds_end_in_one_line(form, damage, people, tmp_path):
    path = FORMS[form](tmp_path, people)
    content = path.read_bytes()
    path.write_bytes({"truncated": content[: len(content) // 2], "emptied": b"", "renamed": content.replace(
        b"landmarks", b"x").replace(b"samples", b"y").replace(b"joint", b"z").replace(b"poses", b"posed")}[damage])
    try:
        feed = read_joints(path)
    except InputError as error:
        assert "\n" not in str(error) and str(tmp_path) in str(error)
    else:
        assert feed.people and (damage, form) in {("truncated", "table"), ("renamed", "fifa")}


def test_names_that_are_not_known_are_named_where_none_is(people, tmp_path):
    path = write_table(tmp_path / "a.csv", {"7": people["7"]}, FPS)
    header, _, rows = path.read_text().partition("\n")
    for name in NAMES:
        rows = rows.replace(f",{name},", f",x_{name},")
    path.write_text(f"{header}\n{rows}")
    with pytest.raises(InputError, match="no known joint, but .*x_left_knee.*; rename"):
        read_joints(path)


def test_an_array_of_objects_is_never_opened(tmp_path):
    np.savez(tmp_path / "a.npz", poses=np.array([{}], dtype=object))
    with pytest.raises(InputError, match="type object"):
        read_joints(tmp_path / "a.npz")


@pytest.mark.skipif(not SAMPLES.is_dir(), reason="the samples in ../shared/data/skeletal are not here")
def test_real_samples(tmp_path):
    feed = read_joints(SAMPLES / "derived_hawkeye_1_1.football.samples.joints")
    assert feed.fps == 30.0 and len(feed.people) == 1 and len(feed.people[0].landmarks) == 29
    line = json.loads((SAMPLES / "cdf_v0.2.3_skeletal.jsonl").read_text())
    rows = [{**line, "timestamp": f"2023-10-01T12:00:{number / 25:09.6f}Z"} for number in range(20)]
    (tmp_path / "a.jsonl").write_text("".join(f"{json.dumps(row)}\n" for row in rows))
    feed = read_joints(tmp_path / "a.jsonl")  # its one frame, again and again
    assert len(feed.people) == 4 and "torso" in " ".join(feed.notes)
