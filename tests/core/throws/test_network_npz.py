"""A file of weights comes back number for number; whatever is wrong in one is one line of InputError."""

import io
import json
import re
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.motion import Motion
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.throws import network_npz
from beyond_mocap.throws.network_npz import read_model, write_model
from beyond_mocap.throws.networks.example import Example
from beyond_mocap.throws.networks.model import ModelSettings, ThrowModel
from beyond_mocap.throws.networks.network import PhaseNetwork


def made_model(kind="hierarchy", dtype=np.float32, examples=2, **changed):
    """A model of random numbers with everything that a model can have."""
    random = np.random.default_rng(5)
    skeleton = Skeleton(("Hips", "Spine", "Hand"), (-1, 0, 1), [[0, 0, 0], [0, 0, 0.4], [0.1, 0.3, 0]], (2,),
                        [[0, 0.1, 0]])  # fmt: skip
    told = ModelSettings(kind=kind, layers=2, units=4, points=3, fps=25.0)
    return ThrowModel(**{
        "settings": told, "skeleton": skeleton,
        "networks": {name: made_network(random, dtype) for name in told.networks},
        "leg_reach": {"left": (0.3, 0.9), "right": (0.31, 0.92)}, "stature": 1.74,
        "examples": tuple(made_example(random, skeleton, i) for i in range(examples)),
        "joint_limits": np.sort(random.normal(size=(3, 3, 3)), axis=1), "reference": random.uniform(size=9),
        "trained_on": "Jané, 40 throws", "notes": ("one", "two"),
    } | changed)  # fmt: skip


def made_network(random, dtype, sizes=(6, 4, 4, 5)):
    pairs = list(zip(sizes, sizes[1:]))
    return PhaseNetwork(
        tuple(random.normal(size=(3, out, width)).astype(dtype) for width, out in pairs),
        tuple(random.normal(size=(3, out)).astype(dtype) for _, out in pairs),
        random.normal(size=6), np.exp(random.normal(size=6)), random.normal(size=5), np.exp(random.normal(size=5)),
    )  # fmt: skip


def made_example(random, skeleton, i):
    turns = random.normal(size=(7, 3, 4))
    turns /= np.linalg.norm(turns, axis=-1, keepdims=True)
    return Example(name=f"throw {i}", subject="Jané", motion=Motion(skeleton, random.normal(size=(7, 3)), turns, 25.0),
                   limb=i, release=3.3 + i / 3, impact=random.normal(size=3),
                   launch=random.normal(size=3) if i else None,
                   stature=1.7, before=random.normal(size=(2, 4, 3)) if i else None)  # fmt: skip


def packed(model, **options):
    """The bytes of the file that a model makes."""
    kept = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(network_npz, "atomic_write", lambda path, data: kept.append(data))
        write_model(model, "x.npz", **options)
    return kept[0]


def unpacked(data):
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        return dict(arrays)


def with_arrays(folder, arrays, name="x.npz"):
    np.savez_compressed(folder / name, **arrays)
    return folder / name


def with_header(folder, change):
    """The file of a model whose header was changed in place by `change`."""
    arrays = unpacked(packed(made_model()))
    header = json.loads(arrays["header"].tobytes())
    change(header)
    return with_arrays(folder, arrays | {"header": np.frombuffer(json.dumps(header).encode(), np.uint8)})


def same(one, other, tolerance=0.0):
    """Assert that two models agree to `tolerance`."""
    assert one.settings == other.settings and one.skeleton.names == other.skeleton.names
    assert one.skeleton.parents == other.skeleton.parents and one.skeleton.end_parents == other.skeleton.end_parents
    assert (one.trained_on, one.notes) == (other.trained_on, other.notes)
    assert list(one.networks) == list(other.networks)
    pairs = [(one.skeleton.offsets, other.skeleton.offsets), (one.skeleton.end_offsets, other.skeleton.end_offsets),
             (one.joint_limits, other.joint_limits), (one.reference, other.reference), (one.stature, other.stature),
             (list(one.leg_reach.values()), list(other.leg_reach.values()))]  # fmt: skip
    for name in one.networks:
        a, b = one.networks[name], other.networks[name]
        pairs += [*zip(a.weights, b.weights), *zip(a.biases, b.biases)]
        pairs += [(getattr(a, scale), getattr(b, scale)) for scale in network_npz._SCALES]
    assert len(one.examples) == len(other.examples)
    for a, b in zip(one.examples, other.examples):
        assert (a.name, a.subject, a.limb) == (b.name, b.subject, b.limb) and (a.launch is None) == (b.launch is None)
        pairs += [(a.motion.root_positions, b.motion.root_positions), (a.motion.rotations, b.motion.rotations),
                  (a.release, b.release), (a.impact, b.impact), (a.stature, b.stature)]  # fmt: skip
        assert a.after is None is b.after and (a.before is None) == (b.before is None)
        pairs += [] if a.before is None else [(a.before, b.before)]
        pairs += [] if a.launch is None else [(a.launch, b.launch)]
    for a, b in pairs:
        np.testing.assert_allclose(a, b, rtol=tolerance, atol=tolerance)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("kind", ["hierarchy", "single"])
def test_a_model_comes_back_number_for_number(tmp_path, kind, dtype):
    model = made_model(kind, dtype)
    write_model(model, tmp_path / "x.npz")
    back = read_model(tmp_path / "x.npz")
    same(back, model)
    assert next(iter(back.networks.values())).weights[0].dtype == dtype
    assert packed(back) == packed(model)


def test_a_model_needs_neither_limits_nor_examples(tmp_path):
    write_model(made_model(joint_limits=None, reference=None, examples=0), tmp_path / "x.npz")
    back = read_model(tmp_path / "x.npz")
    assert back.joint_limits is None and back.reference is None and back.examples == ()


def test_half_is_smaller_and_nearly_the_same(tmp_path):
    model = made_model()
    write_model(model, tmp_path / "x.npz", half=True)
    back = read_model(tmp_path / "x.npz")
    same(back, model, 2e-3)
    assert back.networks["hip"].weights[0].dtype == np.float32
    assert len(packed(model, half=True)) < len(packed(model))


def test_a_weight_that_float16_cannot_hold_is_refused(tmp_path):
    model = made_model()
    hip = model.networks["hip"]
    large = PhaseNetwork((hip.weights[0] * 1e6, *hip.weights[1:]), hip.biases, hip.input_mean, hip.input_scale,
                         hip.output_mean, hip.output_scale)  # fmt: skip
    with pytest.raises(InputError, match="65504"):
        write_model(made_model(networks={**model.networks, "hip": large}), tmp_path / "x.npz", half=True)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_missing_leaves_nothing(tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        write_model(made_model(), tmp_path / "no" / "x.npz")


def refused(path, said=""):
    with pytest.raises(InputError, match=said or None) as told:
        read_model(path)
    assert str(told.value).startswith(str(path)) and "\n" not in str(told.value)


def test_what_is_no_file_of_weights_is_told(tmp_path):
    refused(tmp_path / "none.npz", "no such file")
    refused(tmp_path, "folder")
    (tmp_path / "text.npz").write_text("HIERARCHY\nROOT Hips\n")
    refused(tmp_path / "text.npz", "of another kind")
    (tmp_path / "empty.npz").write_bytes(b"")
    refused(tmp_path / "empty.npz")
    np.savez(tmp_path / "other.npz", weights=np.zeros(4))
    refused(tmp_path / "other.npz", "other content")
    np.savez(tmp_path / "x.checkpoint.npz", told=np.array("{}"), leaf_0000=np.zeros(4))
    refused(tmp_path / "x.checkpoint.npz", "the checkpoint of a training")
    np.save(tmp_path / "one.npy", np.zeros(4))
    refused(tmp_path / "one.npy")


def test_an_object_is_never_unpickled(tmp_path):
    arrays = unpacked(packed(made_model()))
    np.savez(tmp_path / "x.npz", **arrays, evil=np.array([{"a": 1}], dtype=object))
    refused(tmp_path / "x.npz", "type object")


@pytest.mark.parametrize("name, change, said", [
    ("hip/weights/0", lambda a: a[:, :, :-1], "layer 1"),
    ("hip/weights/1", lambda a: a[:2], "layer 2"),
    ("body/biases/2", lambda a: a[0], "layer 3"),
    ("body/input_scale", lambda a: a * 0, "scale"),
    ("left_leg/weights/0", lambda a: a * np.nan, "NaN or infinite"),
    ("offsets", lambda a: a[:2], "shape"),
    ("joint_limits", lambda a: a[:, ::-1], "joint_limits"),
    ("reference", lambda a: a[None], "reference"),
    ("examples/0/turns", lambda a: a * 0, "unit quaternions"),
    ("examples/1/turns", lambda a: a[:, :2], "motion"),
    ("examples/1/root", lambda a: a[:3], "motion"),
    ("examples/1/before", lambda a: a[:, :3], "before"),
])
def test_a_wrong_array_is_named(tmp_path, name, change, said):
    arrays = unpacked(packed(made_model()))
    refused(with_arrays(tmp_path, arrays | {name: change(arrays[name])}), said)


@pytest.mark.parametrize("name", ["header", "offsets", "hip/weights/2", "single/biases/0", "examples/1/root"])
def test_an_array_that_is_missing_or_too_many_is_told(tmp_path, name):
    arrays = unpacked(packed(made_model()))
    if arrays.pop(name, None) is None:
        arrays[name] = np.zeros(3)
    refused(with_arrays(tmp_path, arrays))


@pytest.mark.parametrize("change, said", [
    (lambda h: h.update(version=2), "Beyond Mocap version"),
    (lambda h: h.update(version=[1]), "version"),
    (lambda h: h.update(format="else"), "not a throw model"),
    (lambda h: h["settings"].update(kind="tree"), "hierarchy or single"),
    (lambda h: h["settings"].update(units=5), "hidden layers"),
    (lambda h: h["settings"].update(points=10**30), "points"),
    (lambda h: h["settings"].update(fps=None), "fps"),
    (lambda h: h["settings"].update(layers=True), "layers"),
    (lambda h: h["settings"].pop("wrist"), "wrist"),
    (lambda h: h["skeleton"].update(parents=[-1, 1, 0]), "parents"),
    (lambda h: h["skeleton"].update(end_parents=[9]), "end_parents"),
    (lambda h: h.update(leg_reach={"left": [1, 0.5], "right": [0, 1]}), "leg_reach"),
    (lambda h: h.update(stature="tall"), "stature"),
    (lambda h: h.update(stature=0), "stature"),
    (lambda h: h["examples"].pop(), "unknown array"),
    (lambda h: h["examples"][0].update(limb=4), "limb"),
    (lambda h: h["examples"][0].update(impact=[1, 2]), "impact"),
    (lambda h: h.update(extra=1), "extra"),
    (lambda h: h.update(notes="abc"), "list"),
])
def test_a_wrong_header_is_told_with_its_place(tmp_path, change, said):
    refused(with_header(tmp_path, change), said)


def test_a_header_that_claims_a_huge_array_is_not_believed(tmp_path):
    arrays = unpacked(packed(made_model()))
    with zipfile.ZipFile(tmp_path / "x.npz", "w") as archive:
        for name, array in arrays.items():
            out = io.BytesIO()
            shape = (3, 10**12) if name == "offsets" else array.shape
            header = {"descr": array.dtype.str, "fortran_order": False, "shape": shape}
            np.lib.format.write_array_header_1_0(out, header)
            archive.writestr(name + ".npy", out.getvalue() + array.tobytes())
    refused(tmp_path / "x.npz", "the shape's number of bytes")


@pytest.mark.parametrize("content, said", [
    (b"HIERARCHY", "damaged, truncated or of another kind; expected weights of 'beyond-mocap throw train'"),
    (None, "an .npz with other content; expected weights of 'beyond-mocap throw train'")])
def test_another_file_than_weights_is_named_with_what_is_expected(content, said, tmp_path):
    np.savez(tmp_path / "x.npz", other=np.zeros(3))
    (tmp_path / "x.npz").write_bytes(content or (tmp_path / "x.npz").read_bytes())
    with pytest.raises(InputError, match=f"^{re.escape(str(tmp_path / 'x.npz'))}: {said}.*; (copy|choose)"):
        read_model(tmp_path / "x.npz")


def test_a_file_too_large_is_told(tmp_path, monkeypatch):
    write_model(made_model(), tmp_path / "x.npz")
    monkeypatch.setattr(network_npz, "MAX_UNPACKED_SIZE", 1000)
    refused(tmp_path / "x.npz", "more than 1,000 bytes")
    monkeypatch.setattr(network_npz, "MAX_FILE_SIZE", 1000)
    refused(tmp_path / "x.npz", "at most 1000")


def test_a_file_cut_anywhere_is_told(tmp_path):
    data = packed(made_model(examples=1))
    cuts = {0, 1, 4, 30, 100, *np.linspace(0, len(data) - 1, 60).astype(int), len(data) - 22, len(data) - 1}
    for cut in sorted(cuts):
        (tmp_path / "x.npz").write_bytes(data[:cut])
        refused(tmp_path / "x.npz")


WHOLE = packed(made_model(examples=1))


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(st.integers(0, len(WHOLE) - 1), st.integers(0, 255)), min_size=1, max_size=6))
def test_a_damaged_file_is_told_or_read(tmp_path_factory, changes):
    data = bytearray(WHOLE)
    for place, value in changes:
        data[place] = value
    path = tmp_path_factory.mktemp("fuzz") / "x.npz"
    path.write_bytes(bytes(data))
    try:
        read_model(path)
    except InputError as error:
        assert "\n" not in str(error)


@settings(max_examples=100, deadline=None)
@given(
    st.integers(0, 10**9), st.sampled_from(["offsets", "hip/weights/0", "header"]), st.binary(min_size=1, max_size=40)
)
def test_a_damaged_array_with_a_right_checksum_is_told_or_read(tmp_path_factory, place, name, junk):
    path = tmp_path_factory.mktemp("fuzz") / "x.npz"
    with zipfile.ZipFile(io.BytesIO(WHOLE)) as archive, zipfile.ZipFile(path, "w") as out:
        for member in archive.namelist():
            data = archive.read(member)
            if member == name + ".npy":
                at = place % len(data)
                data = data[:at] + junk + data[at + len(junk) :]
            out.writestr(member, data)
    try:
        read_model(path)
    except InputError as error:
        assert "\n" not in str(error)


def test_a_file_from_before_the_guides_is_read(tmp_path):
    newer = ("guided", "carried", "shoulder")
    path = with_header(tmp_path, lambda header: [header["settings"].pop(name) for name in newer])
    told = read_model(path).settings
    assert (told.guided, told.carried, told.shoulder) == (False, False, "body")
