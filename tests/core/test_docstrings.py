"""What docstrings and comments refer to exists: parameters under Args, and names between backticks."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from architecture import list_nodes

TOP = Path(__file__).resolve().parents[2]
ROOMS = ("beyond_mocap", "scene", "operators", "panels", "training")
ALL = (*ROOMS, "packaging", "sample_blend", "benchmarks", "tests")
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
OUTSIDE = {
    "Figure.subplots",  # matplotlib
    "numpy.arctan2",
    "numpy.cross",
    "calculate_skating_ratio",  # the code of a paper
    "action.beyond_mocap",  # the record on Blender's data, registered by name
    "marker.beyond_mocap",
    "ff_81mph",  # a file's name in a data set
}
"""What is between backticks and is not ours."""
FILES = {"bvh", "c3d", "csv", "dat", "fbx", "html", "json", "md", "npz", "png", "py", "toml", "trc", "txt", "xml"}
"""Last parts of files' names."""


@cache
def list_paths(*folders):
    return [*(path for folder in folders for path in sorted((TOP / folder).rglob("*.py"))), TOP / "batch.py"]


@cache
def collect_names(path):
    """Names that a module's code binds: functions, classes, parameters, variables, attributes, imports."""
    names = set()
    for node in list_nodes(path.read_text("utf-8")):
        match node:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.arg(arg=name):
                names.add(name)
            case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                names.add(name)
            case ast.alias(name=name, asname=other):
                names.add(other or name)
    return frozenset(names)


@cache
def collect_words():
    """Every word of code and tables, docstrings and comments left out."""
    words = set()
    for path in list_paths(*ALL):
        if path != Path(__file__):
            code = re.sub(r'"""[\s\S]*?"""|#.*', "", path.read_text("utf-8"))
            words.update(re.findall(r"\w+", code))
    for path in (TOP / "beyond_mocap").rglob("*.csv"):
        words |= set(re.findall(r"\w+", path.read_text("utf-8")))
    return words


@cache
def list_modules():
    """Last name of a module -> its dotted names, as tuples, and its path."""
    found = {}
    for path in list_paths(*ALL):
        parts = path.relative_to(TOP).with_suffix("").parts
        parts = parts[:-1] if parts[-1] == "__init__" else parts
        found.setdefault(parts[-1], []).append((parts, path))
    return found


def find_modules(parts):
    """Paths of the modules whose dotted name ends like this."""
    return [path for own, path in list_modules().get(parts[-1], ()) if own[-len(parts):] == tuple(parts)]


def list_texts(source):
    """Line and text of each docstring line and comment."""
    lines, inside = source.splitlines(), set()
    for node in list_nodes(source):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            inside |= set(range(node.lineno, node.end_lineno + 1))
    return [(number, line) for number, line in enumerate(lines, 1) if number in inside or "# " in line]


def is_known_dotted(name, own):
    """Whether `module.name`, or `thing.attribute` of a thing that the file itself names, exists."""
    parts = name.split(".")
    if find_modules(parts):
        return True
    for count in range(1, len(parts)):
        if any(parts[count] in collect_names(path) for path in find_modules(parts[:count])):
            return True
    words = collect_words()
    is_thing = parts[0] in own or parts[0][0].isupper() and parts[0] in words
    return is_thing and all(part in words for part in parts[1:])


def find_unknown(source, own):
    """(line, name) of names between backticks that are nowhere in the tree."""
    found = []
    for number, line in list_texts(source):
        for name in re.findall(r"`([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+)`", line):
            if name.split(".")[-1] not in FILES and name not in OUTSIDE and not is_known_dotted(name, own):
                found.append((number, name))
        for name in re.findall(r"`(_?[a-z]+_\w+)(?:\(\))?`", line):
            if name not in OUTSIDE and name not in collect_words():
                found.append((number, name))
    return found


def find_unknown_arguments(source):
    """(function, name) of what stands under Args and is no parameter."""
    found = []
    for node in list_nodes(source):
        if not isinstance(node, FUNCTIONS):
            continue
        block = re.search(r"^Args:\n((?:    .*\n?)*)", ast.get_docstring(node) or "", re.M)
        some = node.args
        known = {one.arg for one in (*some.posonlyargs, *some.args, *some.kwonlyargs, some.vararg, some.kwarg) if one}
        for names in re.findall(r"^    (\S[^:]*):", block.group(1) if block else "", re.M):
            found += [(node.name, name) for name in re.split(r", | and ", names) if name.strip("*") not in known]
    return found


@pytest.mark.parametrize("room", ROOMS)
def test_names_between_backticks_exist(room):
    found = [
        f"{path.relative_to(TOP)}:{line} {name}" for path in list_paths(room)
        for line, name in find_unknown(path.read_text("utf-8"), collect_names(path))
    ]  # fmt: skip
    assert found == []


@pytest.mark.parametrize("room", ROOMS)
def test_args_name_parameters(room):
    found = [
        f"{path.relative_to(TOP)} {function}: {name}" for path in list_paths(room)
        for function, name in find_unknown_arguments(path.read_text("utf-8"))
    ]  # fmt: skip
    assert found == []


@pytest.mark.parametrize(("text", "names"), [
    ("`contacts.detect_contacts`", []), ("`contacts.no_such_thing`", ["contacts.no_such_thing"]),
    ("`motion.track.clean_track`", []), ("`example.csv`", []), ("`take.provenance`", []),
    ("`takes.provenance`", ["takes.provenance"]), ("`Library.kept`", []),
    ("`read_track_csv`", []), ("`no_such_function()`", ["no_such_function"]),
])  # fmt: skip
def test_planted_names_are_resolved(text, names):
    assert [name for _, name in find_unknown(f'"""{text}"""\nx = 0  # {text}\n', {"take"})] == 2 * names


def test_planted_args_are_compared():
    text = ('def shoot(ball, *more):\n    """Shoot.\n\n    Args:\n        ball: one.\n'
            '        *more: all.\n        foot: no.\n    """')
    assert find_unknown_arguments(text) == [("shoot", "foot")]
