"""A model comes back number for number, and what is wrong in a file is told with its place."""

import json
from operator import attrgetter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from beyond_mocap.files.json_values import check_number
from beyond_mocap.markers.files.model_json import format_model, parse_model, read_model, write_model
from tests.core.markers.files.small_model import small_model


def same(one, other):
    """Whether two models agree, number for number."""
    told = ("markers", "ball", "subject", "sessions", "set_name", "notes", "freedom.order", "skeleton.names",
            "skeleton.parents", "skeleton.end_parents")  # fmt: skip
    arrays = ("joint", "places", "sigma", "edge_sigma", "stiffness", "centre_sigma", "freedom.free", "freedom.low",
              "freedom.high", "skeleton.offsets", "skeleton.end_offsets")  # fmt: skip
    equal = [attrgetter(name)(one) == attrgetter(name)(other) for name in told]
    equal += [np.array_equal(attrgetter(name)(one).astype(float), attrgetter(name)(other).astype(float), equal_nan=True)
              for name in arrays]  # fmt: skip
    return all(equal)


@pytest.mark.parametrize("ball", [True, False])
def test_a_model_comes_back_number_for_number(tmp_path, ball):
    model = small_model(ball)
    write_model(model, tmp_path / "model.json")
    assert same(read_model(tmp_path / "model.json"), model)
    assert format_model(read_model(tmp_path / "model.json")) == format_model(model)


def test_a_small_file_is_enough():
    said = """{"version": 1, "joints": [{"name": "Hips", "parent": null, "offset": [0, 0, 0]}],
               "markers": [{"label": "A", "joint": "Hips", "place": [0, 0.1, 0], "sigma": 0.002}]}"""
    model = parse_model(said)
    assert model.freedom.free.all() and np.isinf(model.freedom.high).all()
    assert np.isnan(model.edge_sigma).all() and (model.stiffness == 0).all() and model.ball is None


def test_a_number_that_is_none_in_a_text():
    with pytest.raises(InputError, match="NaN"):
        parse_model(format_model(small_model()).replace("0.037", "NaN"))


@pytest.mark.parametrize("path, value, said", [
    (["version"], 2, "version: 2; expected 1"),
    (["joints"], [], "joints: none"),
    (["joints"], {}, "joints: {}; expected a list"),
    (["joints", 1, "parent"], "Hop", "joint 2: parent: no joint 'Hop'"),
    (["joints", 1, "parent"], "Hand", "joints out of order"),
    (["joints", 0, "parent"], "Hips", "joints out of order"),
    (["joints", 2, "name"], "Arm", "joints: 'Arm' twice"),
    (["joints", 1, "order"], "XXY", "axis order"),
    (["joints", 1, "free"], [1, 2, 3], "joint 2: free"),
    (["joints", 1, "low"], [0.1, 0, 0], "limits that exclude zero"),
    (["joints", 1, "low"], [0, 0], "joint 2: low: 2 values"),
    (["joints", 1, "offset"], [0, 1e9, 0], "joint 2: offset: 1e\\+09 m"),
    (["joints", 1, "stiffness"], -1, "stiffness below zero"),
    (["joints", 1, "colour"], "red", "joint 2: \"colour\""),
    (["markers"], [], "no markers"),
    (["markers", 0, "joint"], "Foot", "marker 1: joint: no joint 'Foot'"),
    (["markers", 0, "label"], "B b", "two markers with one name"),
    (["markers", 0, "sigma"], 0, "sigma"),
    (["markers", 0, "place"], [1, 2], "marker 1: place"),
    (["ball", "radius"], 37, "ball: radius: 37 m"),
    (["ball", "centre"], None, "ball: centre"),
    (["notes"], [1], "notes: 1; expected a text"),
])  # fmt: skip
def test_what_is_wrong_is_reported_with_its_place(path, value, said):
    whole = json.loads(format_model(small_model()))
    at = whole
    for step in path[:-1]:
        at = at[step]
    at[path[-1]] = value
    with pytest.raises(InputError, match=said):
        parse_model(json.dumps(whole), "m.json")


def test_a_value_that_is_too_deep_to_be_shown_is_reported():
    deep = []
    for _ in range(100000):
        deep = [deep]
    with pytest.raises(InputError, match="player 1: a value nested too deeply; expected a number"):
        check_number(deep, "player 1")


def test_files_that_are_none(tmp_path):
    (tmp_path / "a").write_bytes(b"\x80\xfe")
    (tmp_path / "b").write_text("[" * 100000)
    (tmp_path / "c").write_text('{"version": 1,\n "joints"')
    for name, said in (("missing", "no such file"), (".", "a folder"), ("a", "not UTF-8"), ("b", "b"), ("c", "c:2:10")):
        with pytest.raises(InputError, match=said) as told:
            read_model(tmp_path / name)
        assert "\n" not in str(told.value)


VALUES = st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False) | st.integers() | st.text(max_size=5),
    lambda one: st.lists(one, max_size=4) | st.dictionaries(st.sampled_from(["name", "joint", "offset", "x"]), one),
    max_leaves=8,
)


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_any_value_in_any_place_is_read_or_reported(data):
    whole = json.loads(format_model(small_model()))
    at, path = whole, []
    while True:
        keys = list(at) if isinstance(at, dict) else list(range(len(at)))
        key = data.draw(st.sampled_from(keys))
        if isinstance(at[key], (dict, list)) and at[key] and data.draw(st.booleans()):
            at, path = at[key], [*path, key]
            continue
        at[key] = data.draw(VALUES)
        break
    try:
        parse_model(json.dumps(whole))
    except InputError as error:
        assert "\n" not in str(error)
