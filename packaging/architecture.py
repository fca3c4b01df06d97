"""The architecture: which package may import which, and the actual imports of the source, read without running it.

`tests/core/test_architecture.py` checks it, `packaging/draw_architecture.py` draws it. Every import is one dotted name
from the clone's top: `from ..plan import Plan` in `beyond_mocap/synthesis/search/request.py` is
`beyond_mocap.synthesis.plan.Plan`.
"""

from __future__ import annotations

import ast
import functools
import gc
import pathlib
import sys
from collections.abc import Iterator
from typing import NamedTuple

TOP = pathlib.Path(__file__).resolve().parents[1]
CORE = "beyond_mocap"
FEATURES = ("path_editing", "passes", "throws", "markers", "skeletal", "study")
LAYERS = (("base",), ("motion",), ("annotation", "appearance"), ("synthetic",), ("files", "ball"), ("library",),
          ("synthesis",), ("evaluation",), FEATURES, ("match",), ("cli",))
"""The packages of the core from the bottom up: a package imports only packages of lower layers."""
GROUND_TRUTH = "synthetic.ground_truth"
"""Synthetic recordings with ground truth, built with the features that tests check with them: its layer is above the
features and below `match`."""
FILES_MAY = ("base", "motion", "annotation")
BLENDER = {"bpy", "mathutils", "gpu", "gpu_extras", "bpy_extras", "blf", "bl_ui", "bl_operators", "bmesh",
           "addon_utils", "rna_prop_ui", "rna_keymap_ui", "imbuf", "aud", "idprop", "pxr"}  # fmt: skip
MAX_FILES = 25
"""Python files in one folder at most."""


@functools.cache
def parse_source(text: str) -> ast.Module:
    """Parse a source; its tree is kept. Python does not look for garbage meanwhile, over and over in all trees."""
    gc.disable()
    try:
        return ast.parse(text)
    finally:
        gc.enable()


@functools.cache
def list_nodes(text: str) -> tuple[ast.AST, ...]:
    """List all nodes of a source's syntax tree, as `ast.walk` gives them; kept, for every check of the source asks."""
    return tuple(ast.walk(parse_source(text)))


class Import(NamedTuple):
    """One imported name.

    Attributes:
        where: file and line.
        name: dotted from the top.
        lazy: whether it is inside a function.
        relative: whether it is written relatively.
    """

    where: str
    name: str
    lazy: bool
    relative: bool


def list_sources(*folders: str) -> list[pathlib.Path]:
    """List the Python files below some folders.

    Args:
        folders: relative to the top.
    Returns:
        Paths relative to the top.
    """
    return sorted(path.relative_to(TOP) for folder in folders for path in (TOP / folder).rglob("*.py"))


@functools.cache
def read_imports(path: pathlib.Path, text: str) -> tuple[Import, ...]:
    """Read all imports of a file.

    Args:
        path: relative to the top.
        text: the file's content.
    Returns:
        The imports.
    """
    found: list[Import] = []

    def visit(node: ast.AST, lazy: bool) -> None:
        if isinstance(node, ast.Import):
            found.extend(Import(f"{path}:{node.lineno}", alias.name, lazy, False) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            names = _absolute_names(path, node)
            found.extend(Import(f"{path}:{node.lineno}", name, lazy, node.level > 0) for name in names)
        lazy = lazy or isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
        for child in ast.iter_child_nodes(node):
            if not isinstance(child, ast.expr):  # imports are statements
                visit(child, lazy)

    visit(parse_source(text), False)
    return tuple(found)


def _absolute_names(path: pathlib.Path, node: ast.ImportFrom) -> list[str]:
    """List the absolute dotted names that a `from ... import` imports."""
    if node.level == 0:
        return [node.module or ""]
    above = path.parts[: len(path.parts) - node.level]
    module = ".".join([*above, *(node.module.split(".") if node.module else [])])
    return [f"{module}.{alias.name}".lstrip(".") for alias in node.names]


def is_below(name: str, prefix: str) -> bool:
    """Return whether a dotted name is a prefix or lies below it."""
    return name == prefix or name.startswith(prefix + ".")


def find_package(name: str) -> str:
    """Find the package of a dotted name of the core; "" for modules at the core's top."""
    inner = name.removeprefix(CORE + ".")
    return GROUND_TRUTH if is_below(inner, GROUND_TRUTH) else inner.partition(".")[0] if "." in inner else ""


def find_layer(room: str) -> float:
    """Find the layer of a package; higher layers import lower ones."""
    if room == GROUND_TRUTH:
        return find_layer("match") - 0.5
    return next((height for height, rooms in enumerate(LAYERS) if room in rooms), len(LAYERS))


def may_import(package: str, other: str) -> bool:
    """Return whether a file of `room` may import from `other`."""
    if package == other or not other:
        return True
    return find_layer(other) < find_layer(package) and (package != "files" or other in FILES_MAY)


@functools.cache
def list_modules() -> dict[str, pathlib.Path]:
    """List the modules of the product.

    Returns:
        Dotted name -> file, relative to the top.
    """
    files = list_sources(CORE, "scene", "operators", "panels")
    return {".".join(path.with_suffix("").parts).removesuffix(".__init__"): path for path in files}


def find_file(name: str) -> pathlib.Path | None:
    """Find the file of an imported dotted name: the module itself, or the one that defines it."""
    files = list_modules()
    return files.get(name) or files.get(name.rpartition(".")[0])


def build_file_graph() -> dict[pathlib.Path, set[pathlib.Path]]:
    """Build the graph of imports between files, those inside functions included.

    Returns:
        File -> the files that it imports.
    """
    graph = {}
    for path in list_modules().values():
        imported = (find_file(one.name) for one in read_imports(path, (TOP / path).read_text("utf-8")))
        graph[path] = {other for other in imported if other is not None and other != path}
    return graph


def find_cycles(graph: dict) -> list[list]:
    """Find import cycles: Tarjan's strongly connected components of more than one node.

    Args:
        graph: node -> the nodes that it reaches directly.
    Returns:
        The groups of nodes.
    """
    sys.setrecursionlimit(max(sys.getrecursionlimit(), 10 * len(graph) + 1000))
    order: dict = {}
    low: dict = {}
    stack: list = []
    cycles: list[list] = []

    def visit(node) -> None:
        # order: discovery number; low: smallest discovery number on the stack that the node reaches.
        order[node] = low[node] = len(order)
        stack.append(node)
        for other in graph.get(node, ()):
            if other not in order:
                visit(other)
            if other in stack:
                low[node] = min(low[node], low[other])
        if low[node] == order[node]:
            group = stack[stack.index(node) :]
            del stack[stack.index(node) :]
            if len(group) > 1:
                cycles.append(sorted(group))

    for node in graph:
        if node not in order:
            visit(node)
    return cycles


def build_package_graph() -> dict[str, set[str]]:
    """Build the graph of imports between the core's packages, without ground truth.

    Returns:
        Package -> the packages that it imports.
    """
    graph: dict[str, set[str]] = {package: set() for rooms in LAYERS for package in rooms}
    for path, others in build_file_graph().items():
        package, *below = (find_package(".".join(one.with_suffix("").parts)) for one in (path, *others))
        if path.parts[0] == CORE and package in graph:
            graph[package] |= {other for other in below if other in graph} - {package}
    return graph


def count_files(*folders: str) -> Iterator[tuple[str, int]]:
    """Iterate over (folder, number of its Python files) of each folder."""
    parents = [path.parent.as_posix() for path in list_sources(*folders)]
    yield from ((folder, parents.count(folder)) for folder in sorted(set(parents)))
