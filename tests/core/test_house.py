"""The house keeps its walls: who may import whom, read from the source without running it.

Every import of every file is written as one dotted name from the clone's top, so that
`from ..plan import Plan` in `beyond_mocap/library/features.py` is
`beyond_mocap.synthesis.plan.Plan`. A rule then is a list of prefixes a room may use.
"""

import ast
import functools
import pathlib
import re
import sys
import tomllib
from typing import NamedTuple

import pytest

TOP = pathlib.Path(__file__).resolve().parents[2]
CORE = "beyond_mocap"
BLENDER = {"bpy", "mathutils", "gpu", "gpu_extras", "bpy_extras", "blf", "bl_ui", "bl_operators", "bmesh",
           "addon_utils", "rna_prop_ui", "rna_keymap_ui", "imbuf", "aud", "idprop", "pxr"}
ARRAYS = {"numpy", "scipy"}
FORBIDDEN = {"pickle", "cPickle", "dill", "cloudpickle", "marshal", "shelve"}
parsed = functools.cache(ast.parse)  # each file is looked at by several tests
DRAWERS = {"util", "utils", "helper", "helpers", "common", "misc"}

# A room of the core -> the other rooms it may import. Every room may raise the core's own errors.
ROOMS = {
    "errors": [],
    "base": [],
    "motion": [],
    "annotation": ["motion"],
    "plan": ["motion", "annotation"],
    "take": ["motion", "annotation", "plan", "synthesis.search.edit_list"],
    "markers": ["motion", "motion.reach", "motion.foot_plant"],
    "files": ["motion", "annotation", "take", "plan", "match.pieces.named_edit", "match.player_edit",
              "match.crowd.correction",
              "passes.pass_scene", "ball.contact", "markers", "throws.networks"],
    "library": ["motion", "annotation", "files", "motion.foot_plant"],
    "synthesis": ["motion", "annotation", "plan", "library", "motion.reach", "polish.time_warp"],
    "throws.networks": ["motion", "motion.reach"],
    "synthesis.construct": ["motion", "annotation", "library", "plan", "own_size", "take", "polish", "synthesis"],
    "polish": ["motion"],
    "ball": ["motion", "annotation", "library", "polish", "markers.trial", "markers.frames"],
    "stream": ["motion", "files", "ball"],
    "evaluation": ["motion", "annotation", "plan", "take", "ball", "library", "markers", "throws.networks"],
    "study": ["files", "evaluation"],
}
# What a room may import from outside beside numpy and scipy, and only inside the function that needs it.
LAZY = {
    "library": ["sklearn", "threadpoolctl"],
    "files": ["kloppy", "c3d"],
    "evaluation": ["matplotlib"],
    "study": ["matplotlib"],
    "recipe": ["joblib", "dask", "distributed", "matplotlib", "sklearn", "threadpoolctl", "jax", "optax", "training"],
}
# A room of the extension -> what it may import of ours.
EXTENSION = {
    "scene": ["scene", CORE],
    "operators": ["operators", "scene", CORE],
    "panels": ["panels", "scene.core.registration", "scene.core.settings", "scene.core.preferences", "scene.path_editing.settings",
               "scene.path_editing.figure_lines", "scene.passes.settings", "scene.passes.graph", "scene.ball.settings",
               "scene.match.settings", "scene.throws.settings", "scene.markers.settings"],
}


class Import(NamedTuple):
    """One imported name: dotted from the top, whether inside a function, whether written relatively."""

    where: str
    name: str
    lazy: bool
    relative: bool


def sources(*folders):
    """Paths of the Python files below these folders, relative to the top."""
    return sorted(path.relative_to(TOP) for folder in folders for path in (TOP / folder).rglob("*.py"))


def absolute(path, node):
    """The dotted names a `from` statement means, from the top; `path` is relative to it."""
    if node.level == 0:
        return [node.module]
    base = path.parts[: len(path.parts) - node.level]
    module = ".".join([*base, *(node.module.split(".") if node.module else [])])
    return [f"{module}.{alias.name}".lstrip(".") for alias in node.names]


def imports_of(path, text):
    """All imports in one file's text."""
    found = []

    def visit(node, lazy):
        where = f"{path}:{getattr(node, 'lineno', 0)}"
        if isinstance(node, ast.Import):
            found.extend(Import(where, alias.name, lazy, False) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            found.extend(Import(where, name, lazy, node.level > 0) for name in absolute(path, node))
        lazy = lazy or isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))
        for child in ast.iter_child_nodes(node):
            visit(child, lazy)

    visit(parsed(text), False)
    return found


def below(name, prefix):
    """Whether a dotted name is a prefix or lies below it."""
    return name == prefix or name.startswith(prefix + ".")


def room_of(path):
    """The core room a file belongs to; "recipe" for the modules at the core's top that are no room."""
    if (inner := ".".join(path.parts[1:3])) in ROOMS:
        return inner
    name = path.parts[1].removesuffix(".py")
    return name if name in ROOMS else "recipe"


def core_complaint(path, imported):
    """Why this import is not allowed in this core file, or None."""
    room = room_of(path)
    package = imported.name.split(".")[0]
    if package in BLENDER:
        return "the core knows no Blender"
    if imported.relative:
        others = [room, "errors", "base", *ROOMS.get(room, [])]
        allowed = [CORE] if room == "recipe" else [f"{CORE}.{other}" for other in others]
        return None if any(below(imported.name, prefix) for prefix in allowed) else f"{room} may not import this room"
    if package in sys.stdlib_module_names or package in ARRAYS:
        return None
    if package == CORE:
        return "the core imports itself relatively"
    if package not in LAZY.get(room, []):
        return f"{room} may not import this package"
    return None if imported.lazy else "only inside the function that needs it"


def extension_complaint(path, imported):
    """Why this import is not allowed in this file of the extension, or None."""
    room = path.parts[0]
    package = imported.name.split(".")[0]
    if imported.relative:
        return (
            None if any(below(imported.name, prefix) for prefix in EXTENSION[room]) else f"{room} may not import this"
        )
    if package == CORE or package in EXTENSION:
        return "our own modules are imported relatively"
    if package in sys.stdlib_module_names or package in BLENDER or package == "numpy":
        return None
    return f"{room} may not import this package"


def training_complaint(path, imported):
    """Why this import is not allowed in this file of what trains networks, or None."""
    package = imported.name.split(".")[0]
    if package in {"training", CORE} or package in sys.stdlib_module_names:
        return None
    return None if package in {"numpy", "scipy", "jax", "optax"} else "training may not import this package"


def complaints(judge, path, text):
    """One line for each import of a file that the judge does not allow."""
    judged = [(imported, judge(path, imported)) for imported in imports_of(path, text)]
    return [f"{imported.where}: {imported.name}: {reason}" for imported, reason in judged if reason]


def all_complaints(judge, *folders):
    """The complaints of all files below these folders."""
    return [line for path in sources(*folders) for line in complaints(judge, path, (TOP / path).read_text("utf-8"))]


def test_core_rooms_import_only_what_they_may():
    assert all_complaints(core_complaint, CORE) == []


def test_blender_rooms_import_only_what_they_may():
    assert all_complaints(extension_complaint, *EXTENSION) == []


def test_training_imports_only_what_it_may():
    assert all_complaints(training_complaint, "training") == []
    assert complaints(training_complaint, pathlib.Path("training/a.py"), "import sklearn")


@pytest.mark.parametrize("path, text", [
    ("beyond_mocap/motion/a.py", "import bpy"),
    ("beyond_mocap/motion/a.py", "from ..library import features"),
    ("beyond_mocap/motion/a.py", "from .. import plan"),
    ("beyond_mocap/library/a.py", "import sklearn"),
    ("beyond_mocap/library/a.py", "from ..synthesize import synthesize"),
    ("beyond_mocap/synthesis/a.py", "from ..polish import smoothing"),
    ("beyond_mocap/synthesis/phase_network/a.py", "from ...library import features"),
    ("beyond_mocap/synthesis/plan.py", "from beyond_mocap.motion import track"),
    ("beyond_mocap/synthesis/synthesize.py", "import pandas"),
])
def test_a_planted_offence_in_the_core_is_seen(path, text):
    assert len(complaints(core_complaint, pathlib.Path(path), text)) == 1


@pytest.mark.parametrize("path, text", [
    ("beyond_mocap/motion/a.py", "import numpy as np\nfrom . import quaternion\nfrom .skeleton import Skeleton"),
    ("beyond_mocap/library/a.py", "def f():\n    from sklearn.cluster import KMeans"),
    ("beyond_mocap/synthesis/a.py", "from ..polish.reach import solve\nfrom ..polish import reach"),
    ("beyond_mocap/synthesis/synthesize.py", "from .polish import smoothing\nfrom .plan import Plan"),
])
def test_what_is_allowed_in_the_core_passes(path, text):
    assert complaints(core_complaint, pathlib.Path(path), text) == []


@pytest.mark.parametrize("path, text", [
    ("panels/a.py", "from ..operators import synthesize"),
    ("panels/a.py", "from ..beyond_mocap import plan"),
    ("scene/a.py", "from ..operators import synthesize"),
    ("operators/a.py", "from beyond_mocap import plan"),
    ("operators/a.py", "import scipy"),
])
def test_a_planted_offence_in_the_extension_is_seen(path, text):
    assert len(complaints(extension_complaint, pathlib.Path(path), text)) == 1


def test_there_are_no_drawers():
    names = {part for path in sources(CORE, *EXTENSION, "training", "tests", "packaging", "sample_blend", "benchmarks")
             for part in (*path.parts[:-1], path.stem)}
    assert names & DRAWERS == set()


def test_nothing_is_unpickled_or_evaluated():
    offences = []
    for path in sources(CORE, *EXTENSION, "training", "packaging", "sample_blend", "benchmarks"):
        text = (TOP / path).read_text("utf-8")
        offences += [i.where for i in imports_of(path, text) if i.name.split(".")[0] in FORBIDDEN]
        for node in ast.walk(parsed(text)):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in {"eval", "exec"}:
                offences.append(f"{path}:{node.lineno}")
            if isinstance(node, ast.keyword) and node.arg == "allow_pickle" and getattr(node.value, "value", None):
                offences.append(f"{path}:{node.value.lineno}")
    assert offences == []


def test_the_extension_can_be_read_without_blender():
    path = pathlib.Path("__init__.py")
    imported = imports_of(path, (TOP / path).read_text("utf-8"))
    assert [i.where for i in imported if i.name.split(".")[0] in BLENDER and not i.lazy] == []
    assert [i.where for i in imported if i.relative and not i.lazy] == []


def test_one_version_everywhere():
    manifest = tomllib.loads((TOP / "blender_manifest.toml").read_text("utf-8"))
    project = tomllib.loads((TOP / "pyproject.toml").read_text("utf-8"))
    assert manifest["version"] == project["project"]["version"]


def test_links_in_the_docs_lead_somewhere():
    pages = [TOP / "README.md", *sorted((TOP / "docs").glob("*.md"))]
    links = [(page, link) for page in pages for link in re.findall(r"\]\(([^)#\s]+)", page.read_text("utf-8"))]
    assert links
    assert [
        f"{page.name}: {link}" for page, link in links if "://" not in link and not (page.parent / link).exists()
    ] == []
