"""No call of the product passes more than five arguments by their place: a reader sees what each one is."""

import ast
from pathlib import Path

import pytest

from architecture import list_nodes

ROOT = Path(__file__).parents[2]
MOST = 5
TAKE_ANY_NUMBER = {"_build_key_row", "_join_row", "build_page", "build_row", "scale_rows", "option_values", "pack",
                   "zip"}
"""Functions of any number of like parts, which have no names."""


def crowded_calls(source: str) -> list[int]:
    """Lines of calls with more than MOST arguments without a name; stars do not count."""
    calls = [node for node in list_nodes(source) if isinstance(node, ast.Call)]
    return [call.lineno for call in calls if _too_many(call.args) and _name(call.func) not in TAKE_ANY_NUMBER]


def _too_many(arguments: list[ast.expr]) -> bool:
    return len(arguments) > MOST and not any(isinstance(one, ast.Starred) for one in arguments)


def _name(function: ast.expr) -> str:
    return getattr(function, "attr", getattr(function, "id", ""))


@pytest.mark.parametrize("room", ["beyond_mocap", "scene", "operators", "panels"])
def test_no_call_passes_more_than_five_arguments_by_place(room):
    found = [
        f"{path.relative_to(ROOT)}:{line}" for path in sorted((ROOT / room).rglob("*.py"))
        for line in crowded_calls(path.read_text(encoding="utf-8"))
    ]  # fmt: skip
    assert found == []


@pytest.mark.parametrize(("source", "lines"), [
    ("shoot(1, 2, 3, 4, 5)", []),
    ("shoot(1, 2, 3, 4, 5, 6)", [1]),
    ("shoot(1, 2, 3,\n      ball.kick(1, 2, 3, 4, 5, 6), power=5, spin=6)", [2]),
    ("shoot(1, 2, 3, 4, 5, power=6)", []),
    ("shoot(1, 2, 3, 4, *more, 6)", []),
    ("zip(a, b, c, d, e, f)", []),
])  # fmt: skip
def test_a_crowded_call_is_found(source, lines):
    assert crowded_calls(source) == lines
