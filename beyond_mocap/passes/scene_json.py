"""Files of a passing scene (docs/reference/scene-json.md): SCENE.json, samples of it, and the strikes as a table."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, replace
from typing import Any

from ..ball.contact import Tool
from ..base.content import read_utf8
from ..base.errors import InputError
from ..files.atomic import atomic_write
from ..files.json_values import (
    check_bool,
    check_names,
    check_number,
    check_numbers,
    check_object,
    check_text,
    check_whole_number,
    describe_value,
    parse_json,
)
from .pass_scene import BallChoice, Example, Net, Pass, PassScene, Player, Weights

LARGEST = 10_000_000
"""Bytes above which a file is not read as a scene."""
_PASS_FIELDS = ("kind", "bounces", "part", "side", "seconds", "at", "example", "error")

SAMPLES: dict[str, dict] = {
    "three": {
        "players": [{"name": "Ann", "place": [0.0, 3.2]}, {"name": "Ben", "place": [-2.8, -1.6]},
                    {"name": "Cho", "place": [2.8, -1.6]}],
        "passes": [{"from": "Ann", "to": "Ben", "kind": "pass"}, {"from": "Ben", "to": "Cho", "kind": "toss"},
                   {"from": "Cho", "to": "Ann", "kind": "attack"}],
        "repeat": 3,
        "seed": 3,
    },
    "six": {
        "players": [{"name": "Ann", "place": [4.2, 0.0]}, {"name": "Ben", "place": [2.1, 3.7]},
                    {"name": "Cho", "place": [-2.1, 3.7]}, {"name": "Dia", "place": [-4.2, 0.0]},
                    {"name": "Eli", "place": [-2.1, -3.7]}, {"name": "Fay", "place": [2.1, -3.7]}],
        "passes": [{"from": "Ann", "to": "Cho", "kind": "pass"}, {"from": "Cho", "to": "Dia", "kind": "toss"},
                   {"from": "Dia", "to": "Fay", "kind": "attack"}, {"from": "Fay", "to": "Ben", "kind": "pass"},
                   {"from": "Ben", "to": "Eli", "kind": "pass"}, {"from": "Eli", "to": "Ann", "kind": "pass"}],
        "repeat": 2,
    },
    "volley_net": {
        "players": [{"name": "Ann", "place": [-2.2, 1.6]}, {"name": "Ben", "place": [-4.0, -1.6], "part": "head"},
                    {"name": "Cho", "place": [2.4, -1.4]}, {"name": "Dia", "place": [4.2, 1.8]}],
        "passes": [{"from": "Ann", "to": "Ben", "kind": "toss"}, {"from": "Ben", "to": "Cho", "kind": "pass"},
                   {"from": "Cho", "to": "Dia", "kind": "toss"}, {"from": "Dia", "to": "Ann", "kind": "attack"}],
        "defaults": {"bounces": 0},
        "repeat": 2,
        "ball": "volleyball",
        "net": {"from": [0.0, -4.5], "to": [0.0, 4.5], "height": 1.5},
    },
    "racquet": {
        "players": [{"name": "Ann", "place": [-6.5, 0.6], "part": "tool", "side": "right"},
                    {"name": "Ben", "place": [6.5, -0.6], "part": "tool", "side": "right"}],
        "passes": [{"from": "Ann", "to": "Ben"}, {"from": "Ben", "to": "Ann"}],
        "repeat": 3,
        "ball": "tennis",
        "net": {"from": [0.0, -5.0], "to": [0.0, 5.0], "height": 0.95},
        "serve": "Ben",
    },
    "dropped": {
        "players": [{"name": "Ann", "place": [0.0, 3.2]}, {"name": "Ben", "place": [-2.8, -1.6]},
                    {"name": "Cho", "place": [2.8, -1.6]}],
        "passes": [{"from": "Ann", "to": "Ben"}, {"from": "Ben", "to": "Cho"}, {"from": "Cho", "to": "Ann"},
                   {"from": "Ann", "to": "Ben", "error": "dropped"}],
        "lead_out": 2.5,
    },
}

COLUMNS = ("time_s", "frame", "player", "kind", "part", "side", "clip", "clip_frame", "mirrored", "x_m", "y_m", "z_m",
           "speed_in_m_s", "speed_out_m_s", "travel_s", "bounces", "facing_deg", "contact_gap_m", "outcome")


def read_scene(path: str | os.PathLike) -> PassScene:
    """Read a scene from a file.

    Args:
        path: a SCENE.json.
    Returns:
        The scene.
    Raises:
        InputError: names the file and the place in it that is wrong.
    """
    return parse_scene(read_utf8(path, "a SCENE.json", LARGEST), str(path))


def parse_scene(content: str | dict, name: str = "scene") -> PassScene:
    """Parse a scene from a text, or from the JSON object of one.

    Args:
        content: the text or object.
        name: name of the scene in error messages.
    Returns:
        The scene.
    Raises:
        InputError: names the place that is wrong.
    """
    json_object = parse_json(content, name, "docs/reference/scene-json.md") if isinstance(content, str) else content
    try:
        return _parse_scene_object(json_object)
    except InputError as error:
        raise InputError(name, str(error)) from None


def format_scene(scene: PassScene) -> str:
    """Format a scene as the text of a SCENE.json."""
    return json.dumps(to_json(scene), indent=1, ensure_ascii=False) + "\n"


def to_json(scene: PassScene) -> dict:
    """Build the JSON object of a scene, without default values."""
    defaults = PassScene(scene.players, scene.passes)
    out: dict = {"players": list(map(_player_to_json, scene.players)), "passes": list(map(_pass_to_json, scene.passes))}
    for name in ("repeat", "fps", "seed", "transition", "lead_in", "lead_out", "directions", "watch"):
        if getattr(scene, name) != getattr(defaults, name):
            out[name] = getattr(scene, name)
    if scene.ball != defaults.ball:
        out["ball"] = {"kind": scene.ball.kind, **scene.ball.changes} if scene.ball.changes else scene.ball.kind
    if scene.net is not None:
        out["net"] = {"from": list(scene.net.start), "to": list(scene.net.end), "height": scene.net.height}
    if scene.serve is not None:
        out["serve"] = scene.serve if isinstance(scene.serve, str) else list(scene.serve)
    if scene.missed or scene.dropped:
        out["errors"] = {"missed": scene.missed, "dropped": scene.dropped}
    if scene.weights != defaults.weights:
        weights = {entry.name: getattr(scene.weights, entry.name) for entry in fields(Weights)}
        out["weights"] = {**weights, "bones": dict(scene.weights.bones)}
    return out


def _player_to_json(one: Player) -> dict:
    """Build the JSON object of a player, without default values."""
    out: dict = {"name": one.name, "place": list(one.place)}
    if one.facing is not None:
        out["facing"] = _to_degrees(one.facing)
    for name in ("part", "side", "height"):
        if getattr(one, name) != getattr(Player, name):
            out[name] = getattr(one, name)
    if one.tool is not None:
        out["tool"] = {entry.name: getattr(one.tool, entry.name) for entry in fields(Tool)}
    return out


def _pass_to_json(one: Pass) -> dict:
    """Build the JSON object of a pass, without default values."""
    out: dict = {"from": one.giver, "to": one.receiver}
    for name in _PASS_FIELDS:
        value = getattr(one, name)
        if value != getattr(Pass, name):
            out[name] = list(value) if name == "at" else value
    out.pop("example", None)
    if one.example is not None and one.example.hit is None:  # other hit motions have no recording
        example = {"clip": one.example.clip, "from": one.example.start, "to": one.example.end}
        out["example"] = {name: value for name, value in example.items() if value is not None}
    return out


# -- reading


def _parse_scene_object(whole) -> PassScene:
    """Build a scene from its JSON object."""
    read: dict[str, Callable] = {"players": _list_reader(_parse_player), "repeat": check_whole_number,
                                 "fps": check_number, "seed": check_whole_number, "ball": _parse_ball,
                                 "net": _parse_net, "serve": _parse_serve, "transition": check_number,
                                 "lead_in": check_number, "lead_out": check_number, "directions": check_whole_number,
                                 "watch": check_bool, "weights": _parse_weights}
    known = {*read, "passes", "defaults", "errors"}
    check_names(whole, "the scene", known, ("players", "passes"))
    found = {name: of(whole[name], name) for name, of in read.items() if name in whole}
    defaults = _parse_settings(whole.get("defaults", {}), "defaults")
    passes = _list_reader(lambda value, where: _parse_pass(value, where, defaults))(whole["passes"], "passes")
    return PassScene(passes=passes, **found, **_parse_errors(whole.get("errors", {}), "errors"))


def _parse_player(value, where: str) -> Player:
    read: dict[str, Callable] = {"name": check_text, "place": _parse_place, "facing": _parse_angle, "part": check_text,
                                 "side": check_text, "tool": _parse_tool, "height": check_number}
    check_names(value, where, read, ("name", "place"))
    return Player(**{name: of(value[name], f"{where}: {name}") for name, of in read.items() if name in value})


def _parse_pass(value, where: str, defaults: Mapping) -> Pass:
    check_names(value, where, ("from", "to", *_PASS_FIELDS), ("from", "to"))
    settings = _parse_settings({name: value[name] for name in value if name in _PASS_FIELDS}, where)
    giver, receiver = (check_text(value[name], f"{where}: {name}") for name in ("from", "to"))
    return Pass(giver, receiver, **{**defaults, **settings})


def _parse_settings(value, where: str) -> dict:
    """Parse the settings of a pass, without its players."""
    read = {"kind": check_text, "bounces": check_whole_number, "part": check_text, "side": check_text,
            "seconds": check_number, "at": _parse_place, "example": _parse_example, "error": check_text}
    check_names(value, where, read, ())
    return {name: of(value[name], f"{where}: {name}") for name, of in read.items() if name in value}


def _parse_example(value, where: str) -> Example:
    check_names(value, where, ("clip", "from", "to"), ("clip",))
    names = {"from": "start", "to": "end"}
    found: dict[str, Any] = {names[old]: check_number(value[old], f"{where}: {old}") for old in names if old in value}
    return Example(check_text(value["clip"], f"{where}: clip").replace("\\", "/"), **found)


def _parse_tool(value, where: str) -> Tool:
    read: dict[str, Callable] = {"name": check_text, "length": check_number, "radius": check_number,
                                 "reach": check_number}
    check_names(value, where, read, ())
    found = {name: of(value[name], f"{where}: {name}") for name, of in read.items() if name in value}
    try:
        return Tool(**found)
    except InputError as error:
        raise InputError(where, str(error)) from None


def _parse_ball(value, where: str) -> BallChoice:
    """Parse the ball: a kind, or an object with a kind and values that differ from it."""
    if isinstance(value, str):
        return BallChoice(value)
    check_object(value, where)
    changes = {name: _parse_ball_number(one, f"{where}: {name}") for name, one in value.items() if name != "kind"}
    return BallChoice(check_text(value.get("kind", BallChoice.kind), f"{where}: kind"), changes)


def _parse_ball_number(value, where: str):
    return tuple(check_number(one, where) for one in value) if isinstance(value, (list, tuple)) else check_number(value,
            where)


def _parse_net(value, where: str) -> Net:
    check_names(value, where, ("from", "to", "height"), ("from", "to", "height"))
    start, end = (_parse_place(value[name], f"{where}: {name}") for name in ("from", "to"))
    return Net(start, end, check_number(value["height"], f"{where}: height"))


def _parse_serve(value, where: str):
    """Parse the serve: a position, or a name or "ground"."""
    return _parse_triple(value, where) if isinstance(value, (list, tuple)) else check_text(value, where)


def _parse_errors(value, where: str) -> dict[str, Any]:
    """Parse the probabilities of errors."""
    check_names(value, where, ("missed", "dropped"), ())
    return {name: check_number(one, f"{where}: {name}") for name, one in value.items()}


def _parse_weights(value, where: str) -> Weights:
    """Parse the weights of eq. 1 and eq. 2."""
    names = [entry.name for entry in fields(Weights)]
    check_names(value, where, names, ())
    bones = value.get("bones", {})
    check_object(bones, f"{where}: bones")
    factors: dict[str, Any] = {name: check_number(one, f"{where}: {name}") for name, one in value.items()
                               if name != "bones"}
    return replace(Weights(**factors), bones={name: check_number(one, f"{where}: {name}") for name,
                                              one in bones.items()})


def _list_reader(read: Callable) -> Callable:
    """Build a reader for a list whose entries `read` parses."""
    def read_list(value, where: str) -> tuple:
        if not isinstance(value, (list, tuple)):
            raise InputError(where, describe_value(value), "a list [...]")
        one = {"players": "player", "passes": "pass"}[where]
        return tuple(read(entry, f"{one} {number}") for number, entry in enumerate(value, start=1))

    return read_list


def _parse_angle(value, where: str) -> float:
    """Parse an angle in degrees to rad; larger angles are reduced to half a turn."""
    degrees = check_number(value, where)
    return math.radians(degrees if abs(degrees) <= 360.0 else math.remainder(degrees, 360.0))


def _to_degrees(angle: float) -> float:
    """Find the degrees from which reading gives exactly this angle (rad) again, if there are any."""
    degrees_near = math.degrees(angle)
    tried = (degrees_near + ulps * math.ulp(degrees_near) for ulps in (0, 1, -1, 2, -2, 3, -3))
    return next((degrees for degrees in tried if math.radians(degrees) == angle), degrees_near)


def _parse_place(value, where: str) -> tuple[float, float]:
    return check_numbers(value, where, 2, "[x, y] in metres")


def _parse_triple(value, where: str) -> tuple[float, float, float]:
    return check_numbers(value, where, 3, "[x, y, z]")


def write_strikes(path: str | os.PathLike, strikes: Iterable[Mapping]) -> None:
    """Write one row for each strike, in their order.

    Args:
        path: the CSV file.
        strikes: rows; each has every one of COLUMNS, None for an empty cell.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for one in strikes:
        writer.writerow([_format_cell(one[name]) for name in COLUMNS])
    atomic_write(path, out.getvalue())


def _format_cell(value) -> str:
    """Format a value as a CSV cell: 0/1 for bools, six digits for numbers, empty for None and NaN."""
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, float):
        return "" if value != value else f"{value:.6g}"
    return "" if value is None else str(value)
