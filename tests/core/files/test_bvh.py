"""BVH: what a file means, what comes back when it is written, and what is said about files that are no good."""

import pathlib
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from beyond_mocap.base import memory
from beyond_mocap.base.errors import InputError
from beyond_mocap.files.bvh import bvh, bvh_text
from beyond_mocap.files.bvh.bvh_write import BvhForm
from beyond_mocap.motion.humanoid import compute_heading
from beyond_mocap.motion.motion import compute_end_positions, forward_kinematics
from beyond_mocap.synthetic.gait import build_gait

MOCAP = pathlib.Path(__file__).parents[3] / "../shared/data/mocap"
ROOT = "Xposition Yposition Zposition Zrotation Xrotation Yrotation".split()
ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")


class Node:
    """A joint of a made file: name, OFFSET, channels, children, End Sites."""

    def __init__(self, name, offset, channels, *children, ends=()):
        self.name, self.offset, self.channels, self.children, self.ends = name, offset, list(channels), children, ends

    def text(self, kind="ROOT") -> str:
        inside = f"OFFSET {' '.join(map(repr, map(float, self.offset)))}\n"
        if self.channels:
            inside += f"CHANNELS {len(self.channels)} {' '.join(self.channels)}\n"
        inside += "".join(child.text("JOINT") for child in self.children)
        inside += "".join(f"End Site\n{{\nOFFSET {' '.join(map(str, end))}\n}}\n" for end in self.ends)
        return f"{kind} {self.name}\n{{\n{inside}}}\n"

    def walk(self):
        yield self
        for child in self.children:
            yield from child.walk()

    def places(self, row, at=(0.0, 0.0, 0.0), turned=None) -> dict:
        """World positions, file axes and units, for one row (an iterator of numbers): the format's meaning, naively."""
        turned = turned or Rotation.identity()
        offset, turn = np.array(self.offset, dtype=float), Rotation.identity()
        for channel in self.channels:
            value = next(row)
            if channel.endswith("position"):
                offset["XYZ".index(channel[0])] = value
            else:
                turn = turn * Rotation.from_euler(channel[0], value, degrees=True)
        here, turned = np.array(at) + turned.apply(offset), turned * turn
        out = {self.name: here}
        for child in self.children:
            out |= child.places(row, here, turned)
        return out


def document(root: Node, rows, frame_time="0.01", ends="\n") -> bytes:
    lines = [" ".join("%.10g" % v for v in row) for row in rows]
    head = f"HIERARCHY\n{root.text()}MOTION\nFrames: {len(lines)}\nFrame Time: {frame_time}\n"
    return (head + "\n".join(lines) + "\n").replace("\n", ends).encode()


def save(folder, data: bytes, name="a.bvh") -> pathlib.Path:
    path = folder / name
    path.write_bytes(data)
    return path


def body(order="ZXY", every=(), unit=0.01, turn=lambda v: v) -> Node:
    """A man of 1.75 m as BVH joints; `every`: channels that joints below the hips have beside their rotations."""
    channels = [*every, *(axis + "rotation" for axis in order)]

    def joint(name, x, y, z, *children, ends=()):
        return Node(name, turn(np.array([x, y, z]) * 0.01 / unit), channels, *children, ends=ends)

    def leg(side, x):
        toe = joint(f"{side}ToeBase", 0, -7, 14, ends=[turn(np.array([0, 0, 0.06 / unit]))])
        return joint(f"{side}UpLeg", x, -5, 0, joint(f"{side}Leg", 0, -42, 0, joint(f"{side}Foot", 0, -40, 0, toe)))

    spine = joint("Spine", 0, 10, 0, joint("Neck", 0, 40, 0, joint("Head", 0, 10, 0)))
    return Node("Hips", (0, 0, 0), ROOT[:3] + channels[-3:], leg("Left", 9), leg("Right", -9), spine)


def rows_for(root: Node, count=6, seed=0, height=95.0, spread=20.0) -> np.ndarray:
    """Angles anywhere within +-`spread` degrees, offsets where they are, hips at `height` on the second axis."""
    random, rows = np.random.default_rng(seed), np.empty((count, 0))
    for node in root.walk():
        for channel in node.channels:
            column = random.uniform(-spread, spread, count)
            if channel.endswith("position"):
                fixed = node.offset["XYZ".index(channel[0])]
                column = np.full(count, fixed)
                if node is root:
                    column = np.linspace(0, 50, count) + height * (channel[0] == "Y")
            rows = np.column_stack([rows, column])
    return rows


def ours(vector) -> np.ndarray:
    """BVH's axes, Y up, in ours."""
    x, y, z = vector
    return np.array([x, -z, y])


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("every", [(), ROOT[:3], ["Yposition"]], ids=["rotations", "six channels", "one position"])
def test_joints_are_where_the_format_says(tmp_path, order, every):
    root = body(order, every)
    rows = rows_for(root)
    clip = bvh.read_bvh(save(tmp_path, document(root, rows)))
    positions, _ = forward_kinematics(clip.motion)
    for row, frame in zip(rows, positions):
        for name, place in root.places(iter(row)).items():
            assert np.allclose(frame[clip.motion.skeleton.index(name)], ours(place) * 0.01, atol=1e-9)


@pytest.mark.parametrize("channels", ["Zrotation", "Yrotation Xrotation", "Xrotation Yrotation Zrotation", ""])
def test_channel_subsets_come_and_go(tmp_path, channels):
    root = body()
    root.children[0].children[0].channels = channels.split()
    rows = rows_for(root, spread=170.0)
    clip = bvh.read_bvh(save(tmp_path, document(root, rows)))
    assert bvh.write_bvh(tmp_path / "b.bvh", clip.motion, clip.form) == ()
    again = bvh_text.read_bvh_text(tmp_path / "b.bvh")
    assert again.channels == tuple(tuple(node.channels) for node in root.walk())
    back = bvh.read_bvh(tmp_path / "b.bvh")
    assert np.abs(forward_kinematics(back.motion)[0] - forward_kinematics(clip.motion)[0]).max() < 1e-6


def test_a_rotation_that_does_not_fit_its_channels_gets_all_and_is_told(tmp_path):
    clip = bvh.read_bvh(save(tmp_path, document(body(), rows_for(body()))))
    form = BvhForm({**clip.form.channels, "LeftLeg": ("Xrotation",)})
    notes = bvh.write_bvh(tmp_path / "b.bvh", clip.motion, form)
    assert len(notes) == 1 and "LeftLeg" in notes[0]
    back = bvh.read_bvh(tmp_path / "b.bvh")
    assert back.form.channels["LeftLeg"] == ("Xrotation", "Zrotation", "Yrotation")
    assert np.abs(forward_kinematics(back.motion)[0] - forward_kinematics(clip.motion)[0]).max() < 1e-6


@pytest.mark.parametrize("order", ORDERS)
def test_angles_come_back_unless_the_middle_one_is_at_the_pole(tmp_path, order):
    root = body(order)
    random = np.random.default_rng(3)
    rows = rows_for(root, 60, spread=180.0)
    middle = [i for i in range(4, rows.shape[1], 3)]
    rows[:, middle] = random.uniform(-89.99, 89.99, (60, len(middle)))
    rows[:4, middle] = [[89.99], [-89.99], [0.0], [90.0]]
    path = save(tmp_path, document(root, rows))
    clip = bvh.read_bvh(path, 0.01)
    bvh.write_bvh(tmp_path / "b.bvh", clip.motion, clip.form)
    back = bvh_text.read_bvh_text(tmp_path / "b.bvh").values
    difference = (back - bvh_text.read_bvh_text(path).values + 180.0) % 360.0 - 180.0
    assert np.abs(difference[np.arange(60) != 3]).max() < 2e-6
    turned = np.abs(np.sum(bvh.read_bvh(tmp_path / "b.bvh", 0.01).motion.rotations * clip.motion.rotations, axis=-1))
    assert np.all(2 * np.arccos(np.minimum(turned, 1.0)) < 1e-6)


def test_writing_keeps_names_order_channels_and_rate(tmp_path):
    root = body("YXZ", ROOT[:3])
    path = save(tmp_path, document(root, rows_for(root), "0.0333667"))
    clip = bvh.read_bvh(path)
    assert clip.motion.fps == pytest.approx(30000 / 1001, abs=1e-12)
    bvh.write_bvh(tmp_path / "b.bvh", clip.motion, clip.form)
    before, after = bvh_text.read_bvh_text(path), bvh_text.read_bvh_text(tmp_path / "b.bvh")
    assert (after.names, after.parents, after.channels) == (before.names, before.parents, before.channels)
    assert np.allclose(after.offsets[1:], before.offsets[1:], atol=1e-6)
    assert np.allclose(after.end_offsets, before.end_offsets, atol=1e-6)
    assert bvh.read_bvh(tmp_path / "b.bvh").motion.fps == clip.motion.fps


def test_without_a_form_the_root_has_six_channels_and_others_three(tmp_path):
    motion = build_gait(1.4, 0.5)
    bvh.write_bvh(tmp_path / "a.bvh", motion)
    text = bvh_text.read_bvh_text(tmp_path / "a.bvh")
    assert text.channels[0] == tuple(ROOT) and set(text.channels[1:]) == {tuple(ROOT[3:])}
    back = bvh.read_bvh(tmp_path / "a.bvh")
    assert set(back.motion.skeleton.names) == set(motion.skeleton.names)
    assert np.abs(named(back.motion, motion.skeleton) - forward_kinematics(motion)[0]).max() < 1e-6
    tips = [np.sort(compute_end_positions(m)[..., 2], axis=1) for m in (motion, back.motion)]
    assert np.abs(tips[0] - tips[1]).max() < 1e-6
    # centimetres, Y up, pitch y = -Z
    assert np.allclose(text.values[:, :3], motion.root_positions[:, (0, 2, 1)] * (100, 100, -100), atol=1e-5)


def test_a_skeleton_in_any_order_is_nested_and_read_back_alike(tmp_path):
    motion = build_gait(1.4, 0.2)
    old = motion.skeleton
    depth = [len([1 for _ in iter(_climb(old, i))]) for i in range(len(old))]
    order = sorted(range(len(old)), key=lambda i: (depth[i], i))  # breadth first
    place = {joint: i for i, joint in enumerate(order)}
    skeleton = type(old)(
        [old.names[i] for i in order], [-1] + [place[old.parents[i]] for i in order[1:]], old.offsets[order]
    )
    mixed = type(motion)(skeleton, motion.root_positions, motion.rotations[:, order], motion.fps)
    bvh.write_bvh(tmp_path / "a.bvh", mixed)
    back = bvh.read_bvh(tmp_path / "a.bvh").motion
    assert np.abs(named(back, skeleton) - forward_kinematics(mixed)[0]).max() < 1e-6


def named(motion, skeleton) -> np.ndarray:
    """The motion's positions (T, J, 3) in another skeleton's order of names."""
    return forward_kinematics(motion)[0][:, [motion.skeleton.index(name) for name in skeleton.names]]


def _climb(skeleton, joint):
    while joint > 0:
        joint = skeleton.parents[joint]
        yield joint


@pytest.mark.parametrize("unit", [0.01, 1.0, 0.0254, 0.05644, 0.001])
@pytest.mark.parametrize("up", ["Y", "Z"])
def test_unit_and_up_axis_are_seen_in_the_body(tmp_path, unit, up):
    turn = (lambda v: v) if up == "Y" else (lambda v: v[..., [0, 2, 1]] * (1, -1, 1))
    root = body(unit=unit, turn=turn)
    rows = np.tile(rows_for(root, spread=3.0)[:, :1] * 0, (1, 3 + 3 * len(list(root.walk()))))
    rows[:, 2 if up == "Z" else 1] = 0.95 / unit
    clip = bvh.read_bvh(save(tmp_path, document(root, rows)))
    assert clip.form.unit == unit and clip.form.up == up
    assert any("unit" in note and f"{up} up" in note for note in clip.notes)
    assert clip.motion.root_positions[0] == pytest.approx([0, 0, 0.95])
    feet = forward_kinematics(clip.motion)[0][0, clip.motion.skeleton.index("LeftFoot")]
    assert feet[2] == pytest.approx(0.08)


def test_an_odd_unit_gives_legs_of_an_adult_and_a_given_one_is_kept(tmp_path):
    root = body(unit=0.004)
    path = save(tmp_path, document(root, rows_for(root, height=240.0, spread=1.0)))
    clip = bvh.read_bvh(path)
    leg = [clip.motion.skeleton.index(name) for name in ("LeftLeg", "LeftFoot")]
    assert np.linalg.norm(clip.motion.skeleton.offsets[leg], axis=1).sum() == pytest.approx(0.88)
    assert bvh.read_bvh(path, 0.004).form.unit == 0.004
    for wrong in (0.0, -1.0, float("nan")):
        with pytest.raises(InputError, match="unit"):
            bvh.read_bvh(path, wrong)


@pytest.mark.parametrize(
    "frame_time, fps",
    [
        ("0.016667", 60),
        ("0.0083333", 120),
        (".033333", 30),
        ("0.04", 25),
        ("0.0417083", 24000 / 1001),
        ("0.033", 1 / 0.033),
        ("1", 1),
    ],
)
def test_rates_snap_to_whole_and_ntsc_ones(tmp_path, frame_time, fps):
    clip = bvh.read_bvh(save(tmp_path, document(body(), rows_for(body()), frame_time)))
    assert clip.motion.fps == pytest.approx(fps, abs=1e-12)


def test_a_standing_root_above_the_hips_is_folded_and_put_back(tmp_path):
    root = Node("World", (1.0, 2.0, 3.0), ROOT, body("ZYX", ROOT[:3]))
    rows = rows_for(root)
    rows[:, :6] = (100.0, 0.0, -50.0, 0.0, 0.0, 30.0)
    rows[:, 6:9] = np.linspace([0, 95, 0], [0, 96, 80], len(rows))
    path = save(tmp_path, document(root, rows))
    clip = bvh.read_bvh(path)
    assert (
        clip.motion.skeleton.names[0] == "Hips" and clip.form.above[0].name == "World"
        and not clip.form.above[0].is_moving
    )
    assert any("World" in note and "static" in note for note in clip.notes)
    hips = root.places(iter(rows[2]))["Hips"]
    assert np.allclose(clip.motion.root_positions[2], ours(hips) * 0.01, atol=1e-9)
    bvh.write_bvh(tmp_path / "b.bvh", clip.motion, clip.form)
    assert np.allclose(bvh_text.read_bvh_text(tmp_path / "b.bvh").values, rows, atol=1e-5)


def test_a_moving_root_above_the_hips_follows_the_body(tmp_path):
    root = Node("SimulationBone", (0, 0, 0), ROOT, body("ZYX", ROOT[:3]))
    rows = rows_for(root, spread=5.0)
    rows[:, :6] = np.linspace([0, 0, 0, 0, 0, 0], [100, 0, 50, 0, 0, 40], len(rows))
    rows[:, 6:9] = (1.0, 94.0, 2.0)
    clip = bvh.read_bvh(save(tmp_path, document(root, rows)))
    assert clip.form.above[0].is_moving
    bvh.write_bvh(tmp_path / "b.bvh", clip.motion, clip.form)
    back = bvh.read_bvh(tmp_path / "b.bvh")
    assert back.form.above[0].name == "SimulationBone" and back.form.channels == clip.form.channels
    assert np.abs(forward_kinematics(back.motion)[0] - forward_kinematics(clip.motion)[0]).max() < 1e-6
    values = bvh_text.read_bvh_text(tmp_path / "b.bvh").values
    assert np.allclose(values[:, [0, 2]], clip.motion.root_positions[:, :2] * (100, -100), atol=1e-5)
    assert np.allclose(values[:, [1, 3, 4]], 0.0, atol=1e-6)
    turned = np.unwrap(np.radians(values[:, 5])) - compute_heading(clip.motion)
    assert np.ptp(turned) < 1e-6


def test_a_moving_root_right_above_hips_without_positions_carries_them(tmp_path):
    hips = body()
    hips.channels = ROOT[3:]
    hips.offset = (0.0, 95.0, 0.0)
    root = Node("Reference", (0, 0, 0), ROOT, hips)
    rows = rows_for(root, spread=5.0, height=0.0)
    path = save(tmp_path, document(root, rows))
    clip = bvh.read_bvh(path)
    assert bvh.write_bvh(tmp_path / "b.bvh", clip.motion, clip.form) == ()
    back = bvh.read_bvh(tmp_path / "b.bvh")
    assert bvh_text.read_bvh_text(tmp_path / "b.bvh").channels == bvh_text.read_bvh_text(path).channels
    assert np.abs(forward_kinematics(back.motion)[0] - forward_kinematics(clip.motion)[0]).max() < 1e-6


def test_joints_beside_the_hips_are_left_out_and_told(tmp_path):
    root = Node("World", (0, 0, 0), ROOT, body(), Node("IkFoot", (1, 0, 0), ROOT[3:]))
    rows = rows_for(root, height=0.0)
    rows[:, :6], rows[:, 7] = 0.0, 95.0
    clip = bvh.read_bvh(save(tmp_path, document(root, rows)))
    assert "IkFoot" not in clip.motion.skeleton.names and any("IkFoot" in note for note in clip.notes)


def test_a_bone_that_changes_length_takes_its_mean_and_is_told(tmp_path):
    root = body(every=ROOT[:3])
    rows = rows_for(root)
    column = 6 + 6 + 1  # LeftLeg's Yposition
    rows[:, column] = np.linspace(-41.0, -43.0, len(rows))
    clip = bvh.read_bvh(save(tmp_path, document(root, rows)))
    assert clip.motion.skeleton.offsets[clip.motion.skeleton.index("LeftLeg")] == pytest.approx([0, 0, -0.42])
    assert any("LeftLeg 10 mm" in note for note in clip.notes)
    rows[:, column] = np.linspace(-41.95, -42.05, len(rows))
    assert not any("LeftLeg" in note for note in bvh.read_bvh(save(tmp_path, document(root, rows))).notes)


def test_a_body_that_is_no_humanoid_is_read_as_it_is(tmp_path):
    root = Node("Ball", (0, 0, 0), ROOT, Node("Valve", (0, 11, 0), [], ends=[(0, 1, 0), (1, 0, 0)]))
    clip = bvh.read_bvh(save(tmp_path, document(root, rows_for(root, height=11.0))))
    assert clip.motion.skeleton.names == ("Ball", "Valve") and clip.motion.skeleton.end_parents == (1, 1)
    assert "assumed" in clip.notes[0]


@pytest.mark.parametrize("ends", ["\r\n", "\r", "\n\n"], ids=["windows", "old mac", "blank lines"])
def test_line_ends_make_no_difference(tmp_path, ends):
    rows = rows_for(body())
    plain, other = (bvh.read_bvh(save(tmp_path, document(body(), rows, ends=e))) for e in ("\n", ends))
    assert np.array_equal(plain.motion.rotations, other.motion.rotations)


def test_names_with_blanks_and_a_byte_order_mark(tmp_path):
    data = b"\xef\xbb\xbf" + document(body(), rows_for(body())).replace(b"JOINT Neck", "JOINT Bip01 Näck".encode())
    assert "Bip01 Näck" in bvh.read_bvh(save(tmp_path, data)).motion.skeleton.names


def test_two_joints_of_one_name_are_told_apart_and_told(tmp_path):
    clip = bvh.read_bvh(save(tmp_path, document(body(), rows_for(body())).replace(b"JOINT Neck", b"JOINT Spine")))
    assert "Spine_2" in clip.motion.skeleton.names and any("Spine_2" in note for note in clip.notes)


def test_two_thousand_joints_in_a_row(tmp_path):
    count = 2000
    joints = "".join(
        f"{'JOINT' if i else 'ROOT'} j{i}\n{{\nOFFSET 0 1 0\nCHANNELS 3 {' '.join(ROOT[3:])}\n" for i in range(count)
    )
    rows = ("0 " * (3 * count) + "\n") * 2
    data = f"HIERARCHY\n{joints}{'}' * count}\nMOTION\nFrames: 2\nFrame Time: .01\n{rows}".encode()
    clip = bvh.read_bvh(save(tmp_path, data))
    assert len(clip.motion.skeleton) == count
    bvh.write_bvh(tmp_path / "b.bvh", clip.motion, clip.form)


GOOD = document(body(), rows_for(body(), 3))
ROW = GOOD.splitlines()[-2]
FIRST = ROW.split()[5]
BAD = {
    "empty": (b"", "the file is empty"),
    "blank": (b" \n\n", "the file is empty"),
    "binary": (b"\x89PNG\r\n\x1a\n" + bytes(50), ":1: binary content"),
    "text": (b"hello\n", ":1: starts with 'hello'; expected HIERARCHY"),
    "html": (b"<html></html>", "expected HIERARCHY"),
    "cut hierarchy": (GOOD[:300], "no MOTION"),
    "cut before the frame time": (GOOD[: GOOD.index(b"Frame Time")], "Frame Time"),
    "cut row": (GOOD[:-40], "truncated"),
    "missing rows": (GOOD.replace(b"Frames: 3", b"Frames: 5"), "3 rows of motion; expected 5"),
    "too many rows": (GOOD.replace(b"Frames: 3", b"Frames: 2"), "3 rows of motion; expected 2"),
    "no frames": (GOOD.replace(b"Frames: 3", b"Frames: 0"), "above 0"),
    "negative frames": (GOOD.replace(b"Frames: 3", b"Frames: -3"), "above 0"),
    "endless frames": (GOOD.replace(b"Frames: 3", b"Frames: " + b"9" * 500), "above 0"),
    "longer row": (GOOD.replace(ROW, ROW + b" 1.0"), f"expected {len(ROW.split())}"),
    "nan": (GOOD.replace(FIRST, b"nan"), "'nan'; expected a number"),
    "infinite": (GOOD.replace(FIRST, b"1e999"), "'1e999'; expected a number"),
    "word": (GOOD.replace(FIRST, b"1.2.3"), "'1.2.3'; expected a number"),
    "decimal comma": (GOOD.replace(FIRST, FIRST.replace(b".", b",")), "expected a number"),
    "negative frame time": (GOOD.replace(b"Time: 0.01", b"Time: -0.01"), "seconds, 0.001 to 1"),
    "zero frame time": (GOOD.replace(b"Time: 0.01", b"Time: 0"), "seconds, 0.001 to 1"),
    "milliseconds a frame": (GOOD.replace(b"Time: 0.01", b"Time: 33.33"), "seconds, 0.001 to 1"),
    "no frame time": (GOOD.replace(b"Frame Time: 0.01\n", b""), "expected Frame Time"),
    "huge position": (GOOD.replace(ROW, b"1e30 " + ROW.split(b" ", 1)[1]), "beyond 1000 km"),
    "only a byte order mark": (b"\xef\xbb\xbf\n", "the file is empty"),
    "blank lines first": (b"\n" * 20 + b"what", "starts with 'what'"),
    "huge offset": (re.sub(rb"OFFSET \S+", b"OFFSET -1e308", GOOD, count=2), "OFFSET and three numbers of normal size"),
    "long bone": (re.sub(rb"OFFSET 9.0 \S+", b"OFFSET 9.0 1e6", GOOD, count=1),
                  "is 1e+06 from its parent, half of the joints"),
    "huge angle": (GOOD.replace(FIRST, b"1e30"), "expected an angle"),
    "bracket missing": (GOOD.replace(b"}", b"", 1), "bracket"),
    "bracket too many": (GOOD.replace(b"}\nMOTION", b"}}\nMOTION"), "one } too many"),
    "unknown channel": (GOOD.replace(b"Xrotation", b"Wrotation", 1), "CHANNELS"),
    "wrong channel count": (GOOD.replace(b"CHANNELS 3", b"CHANNELS 9", 1), "CHANNELS"),
    "channel twice": (GOOD.replace(b"Zrotation Xrotation", b"Xrotation Xrotation", 1), "a channel is repeated"),
    "offset is no number": (GOOD.replace(b"OFFSET 9.0", b"OFFSET nan", 1), "OFFSET and three numbers"),
    "offset missing": (GOOD.replace(b"OFFSET 9.0 -5.0 0.0\n", b"", 1), "no OFFSET"),
    "two bodies": (GOOD.replace(b"MOTION", b"ROOT b\n{\nOFFSET 0 0 0\n}\nMOTION"), "one ROOT"),
    "no joints": (b"HIERARCHY\nMOTION\nFrames: 1\nFrame Time: 1\n1\n", "no ROOT"),
}


def test_a_file_for_which_memory_lacks_is_refused_before_it_is_parsed(tmp_path, monkeypatch):
    path = save(tmp_path, GOOD)
    monkeypatch.setattr(memory, "read_free_bytes", lambda: 3.0 * len(GOOD))
    bvh.read_bvh(path)  # a small one
    monkeypatch.setattr(bvh_text, "_LARGE_FILE", 0)
    with pytest.raises(InputError, match="a.bvh: this needs about .* free; cut it into shorter recordings"):
        bvh.read_bvh(path)


@pytest.mark.parametrize("case", BAD)
def test_bad_files_get_one_clear_line(tmp_path, case):
    data, says = BAD[case]
    with pytest.raises(InputError) as error:
        bvh.read_bvh(save(tmp_path, data))
    message = str(error.value)
    assert says in message and message.startswith(str(tmp_path)) and "\n" not in message


def test_the_line_of_a_bad_number_is_named(tmp_path):
    data = GOOD.replace(ROW, ROW.replace(FIRST, b"oops"))
    line = data.split(b"\n").index(ROW.replace(FIRST, b"oops")) + 1
    with pytest.raises(InputError, match=rf"a\.bvh:{line}: 'oops'"):
        bvh.read_bvh(save(tmp_path, data))


def test_missing_files_folders_and_places_that_cannot_be_written(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        bvh.read_bvh(tmp_path / "none.bvh")
    with pytest.raises(InputError, match="a folder"):
        bvh.read_bvh(tmp_path)
    motion = build_gait(1.0, 0.2)
    for place in (tmp_path, tmp_path / "none" / "a.bvh"):
        with pytest.raises(InputError, match="cannot be written"):
            bvh.write_bvh(place, motion)
    assert list(tmp_path.parent.glob("*.part")) == [] and list(tmp_path.iterdir()) == []


def test_what_stood_at_the_place_stays_until_all_is_written(tmp_path, monkeypatch):
    path = save(tmp_path, b"precious")

    def torn(motion, form):
        def pieces():
            yield "HIERARCHY\n"
            raise OSError(28, "no space left")

        return pieces(), ()

    monkeypatch.setattr(bvh, "format_bvh", torn)
    with pytest.raises(InputError, match="no space left"):
        bvh.write_bvh(path, build_gait(1.0, 0.2))
    assert path.read_bytes() == b"precious" and list(tmp_path.iterdir()) == [path]


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_damaged_files_are_read_or_refused(tmp_path_factory, data):
    folder = tmp_path_factory.getbasetemp()
    mangled = bytearray(GOOD)
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(mangled)))
        stop = min(start + data.draw(st.integers(0, 30)), len(mangled))
        filler = st.one_of(
            st.binary(max_size=4), st.sampled_from([b"{", b"}", b"-", b"e", b"1e", b".", b"\n", b"nan ", b"JOINT "])
        )
        mangled[start:stop] = data.draw(filler)
    try:
        clip = bvh.read_bvh(save(folder, bytes(mangled), "fuzz.bvh"))
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert np.all(np.isfinite(clip.motion.rotations)) and np.all(np.isfinite(clip.motion.root_positions))


number = st.one_of(
    st.floats(-1e6, 1e6).map(repr),
    st.floats(-1e299, 1e299).map(repr),
    st.floats(-1e4, 1e4).map("{:.6f}".format),
    st.floats(-1e-9, 1e9).map("{:g}".format),
    st.integers(-(10**20), 10**20).map(str),
    st.sampled_from(
        ["0", "-0", "-0.0000", "+5", ".5", "5.", "-.5", "1e5", "1E-05", "1.5e+17", "00012.500", "9007199254740993"]
    ),
)


@given(st.integers(1, 4).flatmap(lambda n: st.lists(st.lists(number, min_size=n, max_size=n), min_size=1, max_size=5)))
def test_numbers_are_those_of_python(rows):
    text = "\n".join(" ".join(row) for row in rows).encode()
    values = bvh_text._parse_rows(pathlib.Path("a.bvh"), b"\n" + text, len(rows[0]), 9)
    expected = np.array([[float(word) for word in row] for row in rows]) + 0.0
    assert values.tobytes() == expected.tobytes()


@pytest.mark.parametrize("word", ["x", "2-3", ".-3", "--3", "1.2.3", "-", ".", "+", "1e", "1_0", "0x1", "nan", "1e300"])
def test_what_is_no_number_is_named_with_its_line(word):
    with pytest.raises(InputError, match=re.escape(f"a.bvh:10: {word!r}; expected a number")):
        bvh_text._parse_rows(pathlib.Path("a.bvh"), f"\n1 2\n3 {word}\n".encode(), 2, 9)


@pytest.mark.skipif(not MOCAP.is_dir(), reason="recordings: no ../shared/data/mocap beside the clone")
@pytest.mark.parametrize(
    "pattern, unit, fps",
    [
        ("cmu10/10_01.bvh", 0.05644, 120),
        ("cmu_jumps/118_01.bvh", 0.05644, 120),
        ("cmu_pitch/*.bvh", 0.05644, 120),
        ("lmd/Player1/P1_S01*.bvh", 0.01, 120),
        ("lafan1/walk1_subject1*.bvh", 0.01, 60),
        ("runs15/*left1*.bvh", 0.01, 120),
        ("bandai/*dash_[an]*.bvh", 0.01, 30),
        ("sprinter/*.bvh", 0.01, 250),
        ("keeper/GK01_trial01*.bvh", 0.01, 200),
        ("getup/*face*.bvh", 0.01, 60),
        ("getup/*roll.bvh", 0.01, None),
    ],
)
def test_recordings_come_back(tmp_path, pattern, unit, fps):
    paths = sorted(MOCAP.glob(pattern))
    assert paths
    for path in paths:
        clip = bvh.read_bvh(path)
        assert (clip.form.unit, clip.form.up, clip.motion.skeleton.names[0]) == (unit, "Y", "Hips")
        assert clip.motion.fps == (fps or clip.motion.fps)
        bvh.write_bvh(tmp_path / "b.bvh", clip.motion, clip.form)
        back = bvh.read_bvh(tmp_path / "b.bvh")
        before, after = bvh_text.read_bvh_text(path), bvh_text.read_bvh_text(tmp_path / "b.bvh")
        assert (before.names, before.channels) == (after.names, after.channels)
        assert np.abs(forward_kinematics(back.motion)[0] - forward_kinematics(clip.motion)[0]).max() < 1e-6
        if not any(joint.is_moving for joint in clip.form.above):
            angles = [c.endswith("rotation") for channels in before.channels for c in channels]
            assert np.abs((before.values - after.values + 180.0) % 360.0 - 180.0)[:, angles].max() < 2e-6
