"""MODEL.npz: a trained model of throws or kicks as a file (docs/reference/network-weights.md).

A zip of plain arrays, with one JSON text for everything else. Nothing in it is ever executed.
"""

from __future__ import annotations

import io
import json
import os
from dataclasses import asdict, fields
from functools import lru_cache
from pathlib import Path

import numpy as np

from ..base.content import read_bytes
from ..base.errors import InputError
from ..files.atomic import atomic_write
from ..files.json_values import (
    check_list,
    check_names,
    check_number,
    check_numbers,
    check_text,
    check_whole_number,
    describe_value,
)
from ..files.plain_npz import HEADER, name_file, read_plain_arrays, take_header
from ..motion.motion import Motion
from ..motion.skeleton import Skeleton
from .networks.chains import EFFECTORS
from .networks.example import Example
from .networks.model import ModelSettings, ThrowModel
from .networks.network import PhaseNetwork

WEIGHTS = Path(__file__).parent / "networks" / "weights"
"""Folder of the weights that are part of the project: ACTION.npz of synthetic examples, ACTION_recorded.npz of
recordings (docs/reference/model-card.md).
"""
RECORDED = "recorded"
"""Name that chooses the weights of recordings where a file of weights may be chosen."""
VERSION = 1
FORMAT = "Beyond Mocap throw model"
MAX_FILE_SIZE = 300_000_000
"""Largest size of a file, bytes."""
MAX_UNPACKED_SIZE = 1_000_000_000
"""Largest size of all arrays together, bytes."""
_KIND = "weights of 'beyond-mocap throw train' (.npz)"
_PAGE = "docs/reference/network-weights.md"
_SCALES = ("input_mean", "input_scale", "output_mean", "output_scale")
_CONTEXT_NAMES = ("before", "after")
_OTHER_KINDS = {"told": "the checkpoint of a training"}  # array that identifies another kind of file
_FLOATS = tuple(np.dtype(name) for name in ("<f2", "<f4", "<f8"))
_NEWER_SETTINGS = ("guided", "carried", "shoulder")  # older files lack them
_HEADER_KEYS = ("format", "version", "settings", "skeleton", "stature", "leg_reach", "trained_on", "notes", "examples")
_EXAMPLE_KEYS = ("name", "subject", "limb", "release", "impact", "launch", "stature")


def read_model(path: str | os.PathLike) -> ThrowModel:
    """Read a model from a file; float16 weights become float32.

    Raises:
        InputError: one line that begins with the file's name, for every fault: missing, truncated, another kind of
            file, NaN or infinite values, shapes that do not match.
    """
    data = read_bytes(path, _KIND, MAX_FILE_SIZE)
    with name_file(path):
        arrays = read_plain_arrays(data, _KIND, _FLOATS, MAX_UNPACKED_SIZE, _OTHER_KINDS)
        half = np.dtype("<f2")
        return _build_model({name: one.astype(np.float32) if one.dtype == half else one for name,
                             one in arrays.items()})


def read_chosen_model(choice: str | os.PathLike | None, action: str) -> ThrowModel:
    """Read the model that a user chose for "throw" or "kick".

    Args:
        choice: a file; `RECORDED`: the project's weights of recordings; None or empty: those of synthetic examples.
        action: "throw" or "kick".
    Raises:
        InputError: if the file is faulty, or the project has no such weights.
    """
    if not choice or str(choice) == RECORDED:
        return read_shipped_model(f"{action}_{RECORDED}" if choice else action)
    if not os.path.exists(choice):
        raise InputError(choice, "no such file", f"a file of weights, or {RECORDED!r} for the project's of recordings",
                         "check the path")
    return read_model(choice)


@lru_cache(maxsize=4)
def read_shipped_model(name: str) -> ThrowModel:
    """Read the model of that name that is part of the project; InputError if it is missing."""
    path = WEIGHTS / f"{name}.npz"
    if not path.is_file():
        raise InputError(path, "no such file", "weights of this name",
                         "train a model with beyond-mocap throw train")  # fmt: skip
    return read_model(path)


def write_model(model: ThrowModel, path: str | os.PathLike, half: bool = False) -> None:
    """Write a model so that `read_model` reads the same numbers; the same model gives the same bytes.

    Args:
        model: the model.
        path: the file.
        half: write weights and the examples' rotations as float16 and all else as float32, a quarter of the size;
            used for the weights that are part of the project.
    Raises:
        InputError: if the file cannot be written, or a weight is too large for float16.
    """
    arrays = {HEADER: np.frombuffer(json.dumps(_build_header(model), allow_nan=False).encode(), np.uint8)}
    arrays |= {"offsets": model.skeleton.offsets, "end_offsets": model.skeleton.end_offsets}
    arrays |= {name: one for name in ("joint_limits", "reference") if (one := getattr(model, name)) is not None}
    arrays |= _collect_network_arrays(model) | _collect_example_arrays(model)
    if half:
        arrays = {name: one if name == HEADER else _reduce_precision(name, one) for name, one in arrays.items()}
    whole = io.BytesIO()
    np.savez_compressed(whole, **arrays)
    atomic_write(path, whole.getvalue())


def _build_header(model: ThrowModel) -> dict:
    """Build the JSON header of a model."""
    skeleton = model.skeleton
    return {
        "format": FORMAT, "version": VERSION, "settings": asdict(model.settings),
        "skeleton": {"names": list(skeleton.names), "parents": list(skeleton.parents),
                     "end_parents": list(skeleton.end_parents)},
        "stature": float(model.stature), "leg_reach": {side: list(pair) for side, pair in model.leg_reach.items()},
        "trained_on": model.trained_on, "notes": list(model.notes),
        "examples": [_format_example(example) for example in model.examples],
    }  # fmt: skip


def _format_example(example: Example) -> dict:
    """Convert the values of an example to JSON."""
    return {
        "name": example.name, "subject": example.subject, "limb": int(example.limb), "release": float(example.release),
        "impact": [float(one) for one in example.impact],
        "launch": None if example.launch is None else [float(one) for one in example.launch],
        "stature": float(example.stature),
    }  # fmt: skip


def _collect_network_arrays(model: ThrowModel) -> dict:
    """Collect the arrays of all networks by name."""
    out = {}
    for name, network in model.networks.items():
        for layer, (weight, bias) in enumerate(zip(network.weights, network.biases)):
            out |= {f"{name}/weights/{layer}": weight, f"{name}/biases/{layer}": bias}
        out |= {f"{name}/{scale}": getattr(network, scale) for scale in _SCALES}
    return out


def _collect_example_arrays(model: ThrowModel) -> dict:
    """Collect the arrays of all examples by name."""
    out = {}
    for i, example in enumerate(model.examples):
        out |= {f"examples/{i}/root": example.motion.root_positions, f"examples/{i}/turns": example.motion.rotations}
        beyond = {side: getattr(example, side) for side in _CONTEXT_NAMES}
        out |= {f"examples/{i}/{side}": places for side, places in beyond.items() if places is not None}
    return out


def _reduce_precision(name: str, values: np.ndarray) -> np.ndarray:
    """Convert to float16 where the last digits do not matter, otherwise to float32."""
    if not ("/weights/" in name or name.endswith("/turns")):
        return values.astype(np.float32)
    if np.abs(values).max(initial=0.0) > np.finfo(np.float16).max:
        raise InputError(name, "a weight above 65504", "weights in the range of float16",
                         "write it with full precision")  # fmt: skip
    return values.astype(np.float16)


def _build_model(arrays: dict[str, np.ndarray]) -> ThrowModel:
    """Build the model from arrays; every array is used once, none is left over."""
    header = take_header(arrays, form=FORMAT, version=VERSION, kind=_KIND, page=_PAGE,
                         remedy="use the Beyond Mocap version that wrote it")
    check_names(header, HEADER, _HEADER_KEYS, _HEADER_KEYS)
    names = [field.name for field in fields(ModelSettings)]
    check_names(header["settings"], "settings", names, [name for name in names if name not in _NEWER_SETTINGS])
    settings = ModelSettings(**header["settings"])
    skeleton = _build_skeleton(header["skeleton"], arrays)
    networks = {name: _build_network(name, settings.layers + 1, arrays) for name in settings.networks}
    rows = check_list(header["examples"], "examples")
    model = ThrowModel(settings=settings, skeleton=skeleton, networks=networks,
                       leg_reach=_parse_reach(header["leg_reach"]),
                       examples=tuple(_build_example(i, row, skeleton, settings.fps, arrays) for i,
                                      row in enumerate(rows)), stature=check_number(header["stature"], "stature"),
                       joint_limits=arrays.pop("joint_limits", None), reference=arrays.pop("reference", None),
                       trained_on=check_text(header["trained_on"], "trained_on"),
                       notes=tuple(check_text(one, "notes") for one in check_list(header["notes"],
                                                                                  "notes")))  # fmt: skip
    if arrays:
        raise InputError("the arrays", f"an unknown array {next(iter(arrays))[:40]!r}", f"the arrays of {_PAGE}")
    return model


def _build_skeleton(row, arrays: dict[str, np.ndarray]) -> Skeleton:
    """Build the skeleton from its JSON row and arrays."""
    known = ("names", "parents", "end_parents")
    check_names(row, "skeleton", known, known)
    names = [check_text(one, "skeleton: names") for one in check_list(row["names"], "skeleton: names")]
    parents = [check_whole_number(one, "skeleton: parents") for one in check_list(row["parents"], "skeleton: parents")]
    ends = [check_whole_number(one, "skeleton: end_parents") for one in check_list(row["end_parents"],
                                                                                   "skeleton: end_parents")]
    if not all(0 <= end < len(names) for end in ends):
        raise InputError("skeleton: end_parents", describe_value(ends), f"joints 0 to {len(names) - 1}")
    offsets, end_offsets = _take_array(arrays, "offsets", (len(names), 3)), _take_array(arrays, "end_offsets",
            (len(ends), 3))
    return Skeleton(tuple(names), tuple(parents), offsets, tuple(ends), end_offsets)


def _parse_reach(row) -> dict[str, tuple]:
    """Parse the leg reach of both legs."""
    check_names(row, "leg_reach", ("left", "right"), ("left", "right"))
    return {side: check_numbers(pair, f"leg_reach: {side}", 2, "[shortest, longest] metres") for side,
            pair in row.items()}


def _build_network(name: str, layers: int, arrays: dict[str, np.ndarray]) -> PhaseNetwork:
    """Build a network from its arrays."""
    weights = tuple(_take_array(arrays, f"{name}/weights/{layer}") for layer in range(layers))
    biases = tuple(_take_array(arrays, f"{name}/biases/{layer}") for layer in range(layers))
    try:
        return PhaseNetwork(weights, biases, *(_take_array(arrays, f"{name}/{scale}") for scale in _SCALES))
    except InputError as error:
        raise InputError(name, str(error)) from None


def _build_example(i: int, row, skeleton: Skeleton, fps: float, arrays: dict[str, np.ndarray]) -> Example:
    """Build example `i` from its JSON row and arrays."""
    where = f"example {i + 1}"
    check_names(row, where, _EXAMPLE_KEYS, _EXAMPLE_KEYS)
    root, turns = _take_array(arrays, f"examples/{i}/root"), _take_array(arrays, f"examples/{i}/turns")
    limb = check_whole_number(row["limb"], f"{where}: limb")
    if not 0 <= limb < len(EFFECTORS):
        raise InputError(f"{where}: limb", str(limb)[:40], "0 to 3")
    if turns.ndim != 3 or turns.shape[2] != 4 or not len(turns) or np.any(np.sum(np.square(turns), axis=-1) < 0.5):
        raise InputError(f"{where}: turns", f"shape {turns.shape}", "(T, J, 4) unit quaternions")
    beyond = {side: arrays.pop(f"examples/{i}/{side}", None) for side in _CONTEXT_NAMES}
    for side, places in beyond.items():
        if places is not None and (places.ndim != 3 or places.shape[1:] != (4, 3)):
            raise InputError(f"{where}: {side}", f"shape {places.shape}", "(N, 4, 3)")
    launch = row["launch"]
    return Example(
        name=check_text(row["name"], f"{where}: name"), subject=check_text(row["subject"], f"{where}: subject"),
        motion=Motion(skeleton, root, turns, fps), limb=limb, release=check_number(row["release"], f"{where}: release"),
        impact=np.array(check_numbers(row["impact"], f"{where}: impact", 3, "[x, y, z] in metres")), launch=None
        if launch is None else np.array(check_numbers(launch, f"{where}: launch", 3, "[x, y, z] in m/s or null")),
        stature=check_number(row["stature"], f"{where}: stature"), **beyond,
    )  # fmt: skip


def _take_array(arrays: dict[str, np.ndarray], name: str, shape: tuple[int, ...] | None = None) -> np.ndarray:
    """Remove an array from those that are left and return it; InputError if it is missing or has another shape."""
    array = arrays.pop(name, None)
    if array is None:
        raise InputError("the arrays", f"no {name!r}", f"the arrays of {_PAGE}", "copy it again or choose another file")
    if shape is not None and array.shape != shape:
        raise InputError(name, f"shape {array.shape}", str(shape))
    return array
