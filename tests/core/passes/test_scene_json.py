"""SCENE.json: read, written back, and every foul of it told in one line."""

import json
import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from beyond_mocap.passes import pose_distance as links
from beyond_mocap.passes.pass_scene import BONES, GROUND, Example, PassScene, find_server
from beyond_mocap.passes.scene_json import SAMPLES as KEPT
from beyond_mocap.passes.scene_json import format_scene, parse_scene, read_scene, to_json

SAMPLES = sorted((Path(__file__).resolve().parents[3] / "sample_blend" / "passes").glob("*.json"))
THREE = {
    "players": [
        {"name": "A", "place": [0, 3]}, {"name": "B", "place": [-2.6, -1.5]}, {"name": "C", "place": [2.6, -1.5]},
    ],
    "passes": [{"from": "A", "to": "B"}, {"from": "B", "to": "C"}, {"from": "C", "to": "A"}],
}


def changed(path, value):
    """THREE as text with what stands at `path` replaced."""
    scene = json.loads(json.dumps(THREE))
    place = scene
    for step in path[:-1]:
        place = place[step]
    if isinstance(place, list) and path[-1] == len(place):
        place.append(value)
    else:
        place[path[-1]] = value
    return json.dumps(scene)


def refused(text):
    with pytest.raises(InputError) as caught:
        parse_scene(text, "scene.json")
    told = str(caught.value)
    assert told.startswith("scene.json") and "\n" not in told
    return told


def test_what_is_not_said_is_as_in_the_paper():
    scene = parse_scene(json.dumps(THREE))
    assert [one.kind for one in scene.passes] == ["pass"] * 3
    assert [one.bounces for one in scene.passes] == [1] * 3
    assert scene.ball.kind == "paper" and scene.fps == 30.0 and scene.watch
    assert math.isclose(scene.find_facing("A"), -math.pi / 2)
    assert find_server(scene) == "C"


def test_everything_that_can_be_said():
    text = changed(["passes", 0], {
        "from": "A", "to": "B", "kind": "attack", "bounces": 0, "part": "head", "side": "left", "seconds": 1.5,
        "at": [1, -1], "example": {"clip": "a\\b.bvh", "from": 1, "to": 2.5}, "error": "missed",
    })  # fmt: skip
    scene = parse_scene(text)
    one = scene.passes[0]
    assert (one.kind, one.bounces, one.part, one.side) == ("attack", 0, "head", "left")
    assert (one.seconds, one.at) == (1.5, (1.0, -1.0))
    assert one.example == Example("a/b.bvh", 1.0, 2.5) and one.error == "missed"
    assert len(scene.order) == 1, "nothing is passed after a missed ball"


def test_defaults_are_every_pass_that_does_not_say_otherwise():
    scene = json.loads(changed(["passes", 1], {"from": "B", "to": "C", "kind": "toss"}))
    scene["defaults"] = {"kind": "attack", "bounces": 2}
    kinds = [(one.kind, one.bounces) for one in parse_scene(json.dumps(scene)).passes]
    assert kinds == [("attack", 2), ("toss", 2), ("attack", 2)]


@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: path.stem)
def test_samples_are_read_and_written_back(path):
    scene = read_scene(path)
    assert parse_scene(format_scene(scene)) == scene
    assert parse_scene(to_json(scene)) == scene
    assert parse_scene(KEPT[path.stem]) == scene


def test_bones_are_those_of_equation_1():
    assert BONES == links.BONES


def test_every_kept_sample_is_a_file():
    assert sorted(KEPT) == [path.stem for path in SAMPLES]


@pytest.mark.parametrize("path, value, word", [
    (["players", 1, "place"], [0.1, 3.2], "apart"),
    (["players", 1, "name"], "a", "two with the name"),
    (["players", 1, "name"], "../a", "a name that a file cannot have"),
    (["players", 1, "name"], "Ball", "a name that a file cannot have"),
    (["players", 1, "place"], [0], "[x, y] in metres"),
    (["players", 1, "place"], [0, 1e9], "place"),
    (["players", 1, "place"], "here", "[x, y] in metres"),
    (["players", 1, "side"], "up", "side"),
    (["players", 1, "heigth"], 2, "check the spelling"),
    (["players", 1, "height"], 20, "from 0.5 to 3"),
    (["players", 1, "tool"], {"length": 3}, "a length up to 2 m"),
    (["players"], [{"name": "A", "place": [0, 0]}], "2 to 100"),
    (["players"], 3, "a list"),
    (["passes"], [], "none"),
    (["passes", 0, "to"], "A", "both passer and receiver"),
    (["passes", 0, "to"], "Z", "one of A, B, C"),
    (["passes", 0], {"from": "A"}, "no 'to'; expected the names from, to; add 'to'"),
    (["passes", 1, "from"], "A", "a pass from B, who gets pass 1"),
    (["passes", 0, "kind"], "kick", "toss, pass, attack"),
    (["passes", 0, "bounces"], -1, "from 0 to 5"),
    (["passes", 0, "bounces"], 1.5, "a whole number"),
    (["passes", 0, "bounces"], True, "a whole number"),
    (["passes", 0, "seconds"], -1, "from 0.2 to 10"),
    (["passes", 0, "seconds"], 0, "from 0.2 to 10"),
    (["passes", 0, "at"], [2.6, -1.4], "C stands there"),
    (["passes", 0, "example"], {"clip": "a", "from": -1}, "a start from 0 s"),
    (["passes", 0, "example"], {"clip": "a", "from": 2, "to": 1}, "a later end"),
    (["passes", 0, "error"], "lost", "missed or dropped"),
    (["players", 0, "place"], [0, 900], "100 m at most"),
    (["repeat"], 0, "from 1"),
    (["fps"], -30, "from 10 to 240"),
    (["fps"], "30", "a number"),
    (["lead_in"], -1, "from 0"),
    (["transition"], 0, "from 0.1"),
    (["directions"], 4, "8, or 0"),
    (["errors"], {"missed": 2}, "from 0 to 1"),
    (["errors"], {"missed": 0.7, "dropped": 0.7}, "a sum of 1"),
    (["weights"], {"speed": -1}, "from 0"),
    (["weights"], {"bones": {"root": "much"}}, "a number"),
    (["weights"], {"bones": {"Tail": 1}}, "one of root, head"),
    (["net"], {"from": [0, 0], "to": [0, 0], "height": 1}, "0.1 m or more"),
    (["net"], {"from": [0, 0], "to": [0, 1]}, "no 'height'"),
    (["serve"], "A", "ground, [x, y, z]"),
    (["serve"], [0, 3, 1], "where A stands"),
    (["serve"], [0, 8, -1], "not below the ground"),
    (["watch"], 1, "true or false"),
    (["speed"], 1, "check the spelling"),
])
def test_fouls_are_told_in_one_line(path, value, word):
    assert word in refused(changed(path, value))


def test_a_chain_that_does_not_close_cannot_be_repeated():
    scene = {**THREE, "passes": THREE["passes"][:2], "repeat": 2}
    assert "pass 1 when repeated" in refused(json.dumps(scene))
    assert len(parse_scene(json.dumps({**THREE, "repeat": 2})).order) == 6


@pytest.mark.parametrize("text", [
    "", "{", "[]", "null", "3", '{"players": 1, "players": 2}', "[" * 100_000, '{"fps": NaN}', '{"a": 1e999}', "\ud800",
])
def test_what_is_no_scene_is_told(text):
    refused(text)


def test_files_that_are_none(tmp_path):
    for content in (b"", b"\xff\xfe\x00", b"\0" * 10, json.dumps(THREE).encode("utf-16")[:-1]):
        (tmp_path / "s.json").write_bytes(content)
        with pytest.raises(InputError) as caught:
            read_scene(tmp_path / "s.json")
        assert "s.json" in str(caught.value)
    with pytest.raises(InputError):
        read_scene(tmp_path / "none.json")
    with pytest.raises(InputError):
        read_scene(tmp_path)


def test_an_ascii_file_with_a_mark_is_read(tmp_path):
    (tmp_path / "s.json").write_bytes(b"\xef\xbb\xbf" + json.dumps(THREE).encode())
    assert isinstance(read_scene(tmp_path / "s.json"), PassScene)


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8)
    | st.sampled_from(["A", "B", "C", "foot", "head", "left", "toss", "missed", "paper", GROUND])
    | st.sampled_from([-1, 0, 1, 1e308, 10**400]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(
        st.sampled_from(["name", "place", "from", "to", "kind", "height", "length", "reach", "clip", "bones"]),
        inner, max_size=3,
    ),
    max_leaves=6,
)  # fmt: skip
NAMES = [
    "fps", "seed", "ball", "net", "serve", "errors", "transition", "lead_in", "lead_out", "directions", "watch",
    "weights", "repeat", "defaults", "players", "passes",
]  # fmt: skip
OF_PLAYER = ["name", "place", "facing", "part", "side", "tool", "height"]
OF_PASS = ["from", "to", "kind", "bounces", "part", "side", "seconds", "at", "example", "error"]
PLACES = (
    st.sampled_from(NAMES).map(lambda name: [name])
    | st.tuples(st.just("players"), st.integers(0, 2), st.sampled_from(OF_PLAYER)).map(list)
    | st.tuples(st.just("passes"), st.integers(0, 2), st.sampled_from(OF_PASS)).map(list)
)


@pytest.mark.parametrize("value", [10**400, -(10**400), 2**63], ids=["400 digits", "below", "64 bits"])
def test_a_seed_beyond_all_numbers_is_told_in_one_line(value):
    with pytest.raises(InputError, match="seed: .{1,60}; expected a whole number") as told:
        parse_scene({**json.loads(json.dumps(KEPT["three"])), "seed": value})
    assert len(str(told.value)) < 200


@pytest.mark.parametrize("degrees", [7.627877270399009e17, 1.7e308, -725.0, 359.99999999999994, 270.0, 0.1, -1e-300])
def test_any_facing_is_written_as_it_is_read(degrees):
    scene = json.loads(json.dumps(KEPT["three"]))
    scene["players"][0]["facing"] = degrees
    found = parse_scene(scene)
    assert parse_scene(format_scene(found)) == found
    wanted = math.radians(math.remainder(degrees, 360.0))
    assert math.isclose(math.cos(found.players[0].facing), math.cos(wanted), abs_tol=1e-9)


@settings(max_examples=400, deadline=None)
@given(st.lists(st.tuples(PLACES, VALUES), min_size=1, max_size=3))
def test_any_value_anywhere_makes_a_scene_or_one_line(changes):
    scene = json.loads(json.dumps(THREE))
    for path, value in changes:
        place = scene
        try:
            for step in path[:-1]:
                place = place[step]
            place[path[-1]] = value
        except (TypeError, KeyError, IndexError):
            pass
    text = json.dumps(scene)
    try:
        found = parse_scene(text, "scene.json")
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert parse_scene(format_scene(found)) == found


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=60))
def test_rubbish_is_told(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("rubbish") / "s.json"
    path.write_bytes(data)
    with pytest.raises(InputError):
        read_scene(path)
