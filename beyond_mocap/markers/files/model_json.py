"""MODEL.json: a reconstructed body with the markers on it, as a file (docs/reference/marker-models.md)."""

from __future__ import annotations

import json
import math
import os

import numpy as np

from ...base.content import read_utf8
from ...base.errors import InputError
from ...files.atomic import atomic_write
from ...files.json_values import (
    check_bool,
    check_list,
    check_names,
    check_number,
    check_numbers,
    check_text,
    check_texts,
    parse_json,
)
from ...motion.skeleton import Skeleton
from ..model.model import BallMarker, Freedom, MarkerModel
from ..trial import find_duplicates

VERSION = 1
MAX_BYTES = 10_000_000  # bytes; a larger file is not a model
_PAGE = "docs/reference/marker-models.md"
_TRIPLE = "[x, y, z] in metres"
_MAX_COORDINATE = 100.0  # metres, largest coordinate within a body
_MAX_ENTRIES = 10_000  # joints or markers at most
_JOINT_KEYS = ("name", "parent", "offset", "order", "free", "low", "high", "stiffness", "centre_sigma")
_MARKER_KEYS = ("label", "joint", "place", "sigma", "edge_sigma")
_MODEL_KEYS = ("version", "subject", "sessions", "marker_set", "notes", "joints", "tips", "markers", "ball")


def read_model(path: str | os.PathLike) -> MarkerModel:
    """Read the model in a file.

    Raises:
        InputError: if anything is wrong, with the file and the place in it.
    """
    return parse_model(read_utf8(path, "a MODEL.json", MAX_BYTES), str(path))


def write_model(model: MarkerModel, path: str | os.PathLike) -> None:
    """Write a model as `read_model` reads it, number for number.

    Raises:
        InputError: if the file cannot be written.
    """
    atomic_write(path, format_model(model))


def format_model(model: MarkerModel) -> str:
    """Format a model as MODEL.json, with one joint and one marker per line."""
    skeleton, names = model.skeleton, model.skeleton.names
    joints = [_format_joint(model, i) for i in range(len(skeleton))]
    tips = [{"joint": names[parent], "offset": _list_numbers(offset)}
            for parent, offset in zip(skeleton.end_parents, skeleton.end_offsets)]  # fmt: skip
    markers = [
        {"label": label, "joint": names[model.joint[i]], "place": _list_numbers(model.places[i]),
         "sigma": _to_json_number(model.sigma[i]), "edge_sigma": _to_json_number(model.edge_sigma[i])}
        for i, label in enumerate(model.markers)
    ]  # fmt: skip
    rows: dict = {"version": VERSION, "subject": model.subject, "sessions": list(model.sessions),
                  "marker_set": model.set_name, "notes": list(model.notes), "joints": joints, "tips": tips,
                  "markers": markers}  # fmt: skip
    if ball := model.ball:
        centre = [float(value) for value in ball.centre]
        rows["ball"] = {"label": ball.label, "joint": names[ball.joint], "centre": centre, "radius": float(ball.radius)}
    return "{\n" + ",\n".join(f" {json.dumps(name)}: {_format_value(value)}" for name, value in rows.items()) + "\n}\n"


def _format_joint(model: MarkerModel, i: int) -> dict:
    """Return the values of a joint for JSON."""
    skeleton, freedom = model.skeleton, model.freedom
    parent = skeleton.parents[i]
    return {"name": skeleton.names[i], "parent": None if parent < 0 else skeleton.names[parent],
            "offset": _list_numbers(skeleton.offsets[i]), "order": freedom.order[i],
            "free": [bool(one) for one in freedom.free[i]], "low": _list_numbers(freedom.low[i]),
            "high": _list_numbers(freedom.high[i]), "stiffness": float(model.stiffness[i]),
            "centre_sigma": _to_json_number(model.centre_sigma[i])}


def _format_value(value) -> str:
    """Format JSON text; a list of objects has one line for each."""
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "[\n" + ",\n".join(f"  {json.dumps(one, ensure_ascii=False)}" for one in value) + "\n ]"
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _list_numbers(values: np.ndarray) -> list:
    return [_to_json_number(value) for value in values]


def _to_json_number(value) -> float | None:
    """Return the number for JSON; null where it is not finite (no value, or no limit)."""
    return float(value) if math.isfinite(value) else None


# -- reading


def parse_model(source: str, name: str = "model") -> MarkerModel:
    """Parse a model.

    Args:
        source: the text.
        name: of the file, for messages.
    Returns:
        The model.
    Raises:
        InputError: if anything is wrong, with name and place.
    """
    whole = parse_json(source, name, _PAGE)
    try:
        return _build_model(whole)
    except InputError as error:
        raise InputError(name, str(error)) from None


def _build_model(whole) -> MarkerModel:
    """Build the model from the parsed JSON."""
    check_names(whole, "the model", _MODEL_KEYS, ("version", "joints", "markers"))
    if whole["version"] != VERSION or isinstance(whole["version"], bool):
        raise InputError("version", str(whole["version"])[:40], str(VERSION), "use the version that wrote it")
    joints = _check_objects(whole["joints"], "joint", _JOINT_KEYS, ("name", "parent", "offset"))
    names = [check_text(row["name"], f"joint {i}: name") for i, row in enumerate(joints, 1)]
    if twice := find_duplicates(names):
        raise InputError("joints", f"{twice[0][:40]!r} twice", "unique names")
    index = {name: i for i, name in enumerate(names)}
    markers = _check_objects(whole["markers"], "marker", _MARKER_KEYS, ("label", "joint", "place", "sigma"))
    tips = _check_objects(whole.get("tips", []), "tip", ("joint", "offset"), ("joint", "offset"))
    return MarkerModel(
        skeleton=_build_skeleton(joints, names, index, tips),
        markers=tuple(check_text(row["label"], f"marker {i}: label") for i, row in enumerate(markers, 1)),
        joint=np.array([_find_joint(row["joint"], f"marker {i}: joint", index) for i, row in enumerate(markers, 1)]),
        places=_read_places(markers, "marker", "place"),
        sigma=np.array([check_number(row["sigma"], f"marker {i}: sigma") for i, row in enumerate(markers, 1)]),
        edge_sigma=_read_column(markers, "marker", "edge_sigma", math.nan), freedom=_build_freedom(joints),
        stiffness=_read_column(joints, "joint", "stiffness", 0.0),
        centre_sigma=_read_column(joints, "joint", "centre_sigma", math.nan), ball=_read_ball(whole.get("ball"), index),
        subject=check_text(whole.get("subject", ""), "subject"), sessions=check_texts(whole.get("sessions", []),
                                                                                      "sessions"),
        set_name=check_text(whole.get("marker_set", ""), "marker_set"),
        notes=check_texts(whole.get("notes", []), "notes"),
    )


def _check_objects(value, what: str, known, needed) -> list[dict]:
    """Check a list of objects and their keys; raise InputError where they are not valid."""
    rows = check_list(value, f"{what}s")
    if len(rows) > _MAX_ENTRIES:
        raise InputError(f"{what}s", f"{len(rows)}", f"at most {_MAX_ENTRIES}")
    for i, row in enumerate(rows, 1):
        check_names(row, f"{what} {i}", known, needed)
    return rows


def _build_skeleton(joints, names, index, tips) -> Skeleton:
    """Build the skeleton from joints and tips."""
    if not joints:
        raise InputError("joints", "none", "a body")
    parents = [-1 if row["parent"] is None else _find_joint(row["parent"], f"joint {i}: parent", index)
               for i, row in enumerate(joints, 1)]  # fmt: skip
    return Skeleton(tuple(names), tuple(parents), _read_places(joints, "joint", "offset"),
                    tuple(_find_joint(row["joint"], f"tip {i}: joint", index) for i, row in enumerate(tips, 1)),
                    _read_places(tips, "tip", "offset"))


def _build_freedom(joints) -> Freedom:
    """Build the freedom; joints without such entries turn freely."""

    def read_row(i: int, joint: dict) -> tuple:
        order = check_text(joint.get("order", "XYZ"), f"joint {i}: order")
        free = [check_bool(one, f"joint {i}: free") for one in _check_three(joint.get("free", [True] * 3),
                                                                            f"joint {i}: free")]
        limits = [[usual if one is None else check_number(one, f"joint {i}: {name}")
                   for one in _check_three(joint.get(name, [None] * 3), f"joint {i}: {name}")]
                  for name, usual in (("low", -math.inf), ("high", math.inf))]  # fmt: skip
        return order, free, *limits

    order, free, low, high = zip(*(read_row(i, joint) for i, joint in enumerate(joints, 1)))
    return Freedom(order, np.array(free), np.array(low), np.array(high))


def _check_three(value, where: str) -> list:
    """Return a list of three values; raise InputError for anything else."""
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(where, f"{len(value)} values" if isinstance(value, list) else "no list", "three values")
    return value


def _read_column(rows, what: str, name: str, usual: float) -> np.ndarray:
    """Read one number from each row; `usual` where it is missing."""
    return np.array([usual if row.get(name) is None else check_number(row[name], f"{what} {i}: {name}")
                     for i, row in enumerate(rows, 1)])  # fmt: skip


def _read_ball(value, index) -> BallMarker | None:
    """Read the ball marker; None where there is none."""
    if value is None:
        return None
    names = ("label", "joint", "centre", "radius")
    check_names(value, "ball", names, names)
    radius = check_number(value["radius"], "ball: radius")
    if not 0.0 < radius < 1.0:
        raise InputError("ball: radius", f"{radius:g} m", "0 to 1 m")
    joint = _find_joint(value["joint"], "ball: joint", index)
    return BallMarker(check_text(value["label"], "ball: label"), joint, _read_place(value["centre"], "ball: centre"),
                      radius)


def _find_joint(value, where: str, index: dict[str, int]) -> int:
    """Return the index of a joint by its name; raise InputError where it does not exist."""
    name = check_text(value, where)
    if name not in index:
        raise InputError(where, f"no joint {name[:40]!r}", "one of the joints", "check the spelling")
    return index[name]


def _read_places(rows, what: str, name: str) -> np.ndarray:
    """Read (N, 3) metres."""
    places = [_read_place(row[name], f"{what} {i}: {name}") for i, row in enumerate(rows, 1)]
    return np.array(places, dtype=float).reshape(-1, 3)


def _read_place(value, where: str) -> tuple[float, float, float]:
    """Read a place of three coordinates in metres."""
    place = check_numbers(value, where, 3, _TRIPLE)
    if max(map(abs, place)) > _MAX_COORDINATE:
        raise InputError(where, f"{max(place, key=abs):g} m", "metres within a body", "check the unit")
    return place
