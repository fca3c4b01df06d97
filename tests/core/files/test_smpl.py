"""Motion of SMPL: axes, bones and faults as planted; there and back; nothing of a file is executed."""

import pathlib

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.files.smpl.smpl import is_smpl_file, read_smpl, write_smpl
from beyond_mocap.files.smpl.smpl_skeleton import JOINTS, PELVIS_AT_REST, TO_CORE, TOE_HEIGHT, build_smpl_skeleton
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion, forward_kinematics

SAMPLES = pathlib.Path(__file__).resolve().parents[3] / ".." / "shared" / "data" / "smpl"
STATURE, FPS, STRIDE = 1.76, 60.0, 1.2


def build_walk(count=240):
    """A walk along +Y whose feet stand still in their stances, by the two bones of each leg."""
    skeleton = build_smpl_skeleton(STATURE)
    rotations = quaternion.identity(count, len(JOINTS))
    rotations[:, 0] = quaternion.from_up_angle(np.full(count, np.pi / 2))
    time = np.arange(count) / FPS
    places, _ = forward_kinematics(Motion(skeleton, np.zeros((1, 3)), rotations[:1], FPS))
    leg = -places[0, JOINTS.index("left_ankle"), 2]
    phase = time / 1.1  # strides
    ahead = np.stack([_swing(phase), _swing(phase + 0.5)], axis=1)  # ankle before the hip, m
    for side, name in enumerate(("left", "right")):
        angle = np.arctan2(ahead[:, side], leg)
        rotations[:, JOINTS.index(f"{name}_hip")] = quaternion.from_axis_angle(np.array([0.0, -1.0, 0.0]), angle)
        rotations[:, JOINTS.index(f"{name}_ankle")] = quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), angle)
    body = Motion(skeleton, np.zeros((count, 3)), rotations, FPS)
    relative, _ = forward_kinematics(body)
    feet = relative[:, [JOINTS.index("left_foot"), JOINTS.index("right_foot")]]
    standing = np.argmin(feet[..., 2], axis=1)  # the lower foot stands: the body moves as it does not
    step = np.diff(feet, axis=0)[np.arange(count - 1), standing[:-1]]
    root = np.concatenate([[(2.0, -1.0, -feet[0, standing[0], 2])], -step]).cumsum(axis=0)
    return Motion(skeleton, root, rotations, FPS)


def _swing(phase):
    """Backwards at an even speed for half of a stride, forwards for the other half; m."""
    part = phase % 1.0
    return STRIDE / 4 * np.where(part < 0.5, 1.0 - 4.0 * part, 4.0 * part - 3.0)


@pytest.fixture(scope="module")
def walk():
    return build_walk()


@pytest.fixture
def stored(walk, tmp_path):
    write_smpl(tmp_path / "walk.npz", walk)
    return tmp_path / "walk.npz"


def save(path, **changes):
    """Write the arrays of a motion with changes; None leaves one out."""
    with np.load(path) as file:
        arrays = {**file, **changes}
    np.savez(path, **{name: value for name, value in arrays.items() if value is not None})
    return path


def test_there_and_back(walk, stored):
    clip = read_smpl(stored)
    assert "as the steps fit" in clip.notes[0] and len(clip.notes) == 1
    before, after = forward_kinematics(walk)[0], forward_kinematics(clip.motion)[0]
    assert np.abs((before - before[:, :1]) - (after - after[:, :1])).max() < 0.02  # the stature is found by the steps
    assert read_smpl(stored, stature=STATURE).motion.fps == FPS
    after, _ = forward_kinematics(read_smpl(stored, stature=STATURE).motion)
    moved = before - after
    assert np.ptp(moved[..., :2]) < 1e-3 and np.ptp(moved[..., 2]) < 1e-3  # but for the ground's height
    with np.load(stored) as file:
        assert file["poses"].shape == (len(walk), 72)
        assert file["trans"] + PELVIS_AT_REST == pytest.approx(walk.root_positions)  # z is up, the pelvis turns not


def test_feet_are_on_the_ground_and_the_body_is_known(stored):
    motion = read_smpl(stored).motion
    places, _ = forward_kinematics(motion)
    feet = places[:, [JOINTS.index("left_foot"), JOINTS.index("right_foot")], 2]
    assert np.percentile(feet, 2) == pytest.approx(TOE_HEIGHT * STATURE, abs=0.005)
    assert identify_joints(motion.skeleton).left.toe == JOINTS.index("left_foot")


@pytest.mark.parametrize("width", [156, 165])
def test_hands_of_the_larger_models(walk, stored, width):
    poses = np.zeros((len(walk), width))
    with np.load(stored) as file:
        poses[:, :66] = file["poses"][:, :66]
    plain = read_smpl(stored).motion
    rate = {"mocap_framerate": None, "mocap_frame_rate": np.array(FPS)} if width == 165 else {}
    motion = read_smpl(save(stored, poses=poses, **rate)).motion
    assert np.array_equal(motion.rotations, plain.rotations)
    poses[5, 80] = 0.5
    assert "fingers, jaw and eyes are left out" in read_smpl(save(stored, poses=poses)).notes


def test_y_up_and_parts_of_gvhmr(walk, stored):
    with np.load(stored) as file:
        poses, trans = file["poses"].reshape(len(walk), 24, 3), file["trans"]
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # z up to y up
    root = quaternion.multiply(quaternion.from_matrix(turn), quaternion.from_rotation_vector(poses[:, 0]))
    prefix = "net_outputs_pred_smpl_params_global_"
    plain = read_smpl(stored)
    save(stored, poses=None, trans=None, mocap_framerate=None, **{
        f"{prefix}global_orient": quaternion.to_rotation_vector(root)[None],
        f"{prefix}transl": ((trans + PELVIS_AT_REST) @ turn.T - PELVIS_AT_REST)[None],
        f"{prefix}body_pose": poses[:, 1:22].reshape(1, len(walk), 63)})
    clip = read_smpl(stored)
    assert "y up" in clip.notes[0] and "no frame rate" in clip.notes[1] and clip.motion.fps == 30.0
    assert np.abs(clip.motion.root_positions - plain.motion.root_positions).max() < 1e-6


def test_true_bones_come_from_a_body_model(walk, stored, tmp_path):
    """A model whose vertices are its joints, longer with the second beta."""
    places, _ = forward_kinematics(Motion(build_smpl_skeleton(1.0), np.array([[0.3, 0.1, -0.2]]),
                                          quaternion.identity(1, len(JOINTS)), FPS))
    mean = places[0] @ TO_CORE
    np.savez(tmp_path / "model.npz", v_template=mean, J_regressor=np.eye(len(JOINTS)),
             shapedirs=np.stack([np.zeros_like(mean), mean], axis=2), other=np.array([{}], dtype=object))
    clip = read_smpl(save(stored, betas=np.array([7.0, 0.8])), body_model=tmp_path / "model.npz")
    assert clip.motion.skeleton.offsets == pytest.approx(build_smpl_skeleton(1.8).offsets)
    assert clip.notes[0].endswith("bones of model.npz")
    assert "need the body model" in read_smpl(stored).notes[0]
    with pytest.raises(InputError, match="v_template"):
        read_smpl(stored, body_model=stored)
    np.savez(tmp_path / "nothing.npz", v_template=mean, J_regressor=np.zeros((22, 22)), shapedirs=np.zeros((22, 3, 1)))
    with pytest.raises(InputError, match="legs of 0 m"):
        read_smpl(stored, body_model=tmp_path / "nothing.npz")


def test_a_glimpse_tells_no_stature(stored):
    with np.load(stored) as file:
        short = {name: file[name][:20] for name in ("poses", "trans")}
    assert "1.70 m tall assumed" in read_smpl(save(stored, **short)).notes[0]


def test_faults_are_told(stored):
    with np.load(stored) as file:
        poses, trans = file["poses"].copy(), file["trans"].copy()
    trans[100:] += (0.23, 0.0, 0.0)
    poses[50, 3 * JOINTS.index("left_elbow")] += 0.86
    notes = read_smpl(save(stored, poses=poses, trans=trans)).notes
    assert "frame 100: the body leaps by 0.2" in " ".join(notes)
    assert "frame 50: left_elbow flips by 49 degrees" in " ".join(notes)


@pytest.mark.parametrize(("change", "said"), [
    ({"poses": np.array([{}], dtype=object)}, "type object"),
    ({"poses": np.zeros((240, 71))}, r"poses \(240, 71\)"),
    ({"poses": np.full((240, 72), np.nan)}, "NaN"),
    ({"trans": np.zeros((9, 3))}, r"trans \(9, 3\)"),
    ({"trans": np.full((240, 3), 1e7)}, "metres"),
    ({"trans": None}, "arrays betas"),
    ({"poses": np.zeros((1, 72)), "trans": np.zeros((1, 3))}, "1 frame"),
    ({"mocap_framerate": np.array(0.0)}, "1 to 1000"),
    ({"mocap_framerate": np.zeros(0)}, "1 to 1000"),
])  # fmt: skip
def test_bad_files_are_refused_in_one_line(stored, change, said):
    with pytest.raises(InputError, match=said) as caught:
        read_smpl(save(stored, **change))
    assert str(stored) in str(caught.value) and "\n" not in str(caught.value)


def test_pickles_are_never_opened(tmp_path):
    (tmp_path / "clip.pkl").write_bytes(b"cos\nsystem\n(S'exit 1'\ntR.")
    with pytest.raises(InputError, match="never opened"):
        read_smpl(tmp_path / "clip.pkl")
    (tmp_path / "text.npz").write_text("no zip")
    assert not is_smpl_file(tmp_path / "text.npz")
    with pytest.raises(InputError, match="damaged"):
        read_smpl(tmp_path / "text.npz")


@pytest.mark.skipif(not SAMPLES.is_dir(), reason="the samples in ../shared/data/smpl are not here")
def test_real_motions_stand_on_the_ground_and_fit_their_steps():
    statures = []
    for path in sorted(SAMPLES.glob("*.npz")):
        assert is_smpl_file(path)
        clip = read_smpl(path)
        places, _ = forward_kinematics(clip.motion)
        assert -0.02 < places[..., 2].min() and 0.7 < np.median(places[:, 0, 2]) < 1.1
        statures.append(float(clip.notes[0].split(" m tall")[0].split()[-1]))
        assert ("leaps" in " ".join(clip.notes)) == ("single_foot_balance" in path.name)
    assert 1.55 < min(statures) and max(statures) < 1.75  # all but one are of one body of unknown stature
