"""The house keeps its walls (packaging/architecture.py has the plan): who may import whom, read from the source without
running it."""

import ast
import pathlib
import re
import sys
import tomllib

import pytest

import draw_architecture
from architecture import (
    BLENDER,
    CORE,
    LAYERS,
    MAX_FILES,
    TOP,
    build_file_graph,
    count_files,
    find_cycles,
    find_package,
    is_below,
    list_nodes,
    list_sources,
    may_import,
    read_imports,
)

ARRAYS = {"numpy", "scipy"}
FORBIDDEN = {"pickle", "cPickle", "dill", "cloudpickle", "marshal", "shelve"}
PRODUCT = (CORE, "scene", "operators", "panels", "training", "packaging", "sample_blend", "benchmarks")
DRAWERS = {"util", "utils", "helper", "helpers", "common", "misc"}
# What a room may import from outside beside numpy and scipy, and only inside the function that needs it.
LAZY = {
    "files": ["kloppy"],
    "library": ["joblib", "sklearn", "threadpoolctl"],
    "synthesis": ["threadpoolctl"],
    "evaluation": ["matplotlib", "sklearn", "threadpoolctl"],
    "markers": ["c3d", "matplotlib"],
    "study": ["matplotlib"],
    "match": ["distributed", "joblib"],
    "cli": ["jax", "optax", "training"],
}
SETTINGS = re.compile(r"scene\.\w+\.settings(\.|$)")
PANELS = ("panels", "scene.core.registration", "scene.core.preferences")  # beside the rooms' settings


def core_complaint(path, imported):
    """Why this import is not allowed in this core file, or None."""
    room = find_package(".".join(path.with_suffix("").parts))
    package = imported.name.split(".")[0]
    if package in BLENDER:
        return "the core knows no Blender"
    if imported.relative:
        if imported.name == f"{CORE}.__version__":
            return None
        other = find_package(imported.name if imported.name.count(".") > 1 else imported.name + ".")
        return None if not room or may_import(room, other) else f"{room} may not import {other}"
    if package in sys.stdlib_module_names or package in ARRAYS:
        return None
    if package == CORE:
        return "the core imports itself relatively"
    if package not in LAZY.get(room.partition(".")[0], []):
        return f"{room} may not import this package"
    return None if imported.lazy else "only inside the function that needs it"


def extension_complaint(path, imported):
    """Why this import is not allowed in this file of the extension, or None."""
    room, package = path.parts[0], imported.name.split(".")[0]
    if imported.relative:
        rooms = {"scene": ("scene", CORE), "operators": ("operators", "scene", CORE), "panels": PANELS}[room]
        allowed = any(is_below(imported.name, one) for one in rooms)
        return None if allowed or room == "panels" and SETTINGS.match(imported.name) else f"{room} may not import this"
    if package in {CORE, "scene", "operators", "panels"}:
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
    judged = [(imported, judge(path, imported)) for imported in read_imports(path, text)]
    return [f"{imported.where}: {imported.name}: {reason}" for imported, reason in judged if reason]


def all_complaints(judge, *folders):
    """The complaints of all files below these folders."""
    return [
        line for path in list_sources(*folders) for line in complaints(judge, path, (TOP / path).read_text("utf-8"))
    ]


def test_core_rooms_import_only_downward():
    assert all_complaints(core_complaint, CORE) == []


def test_every_room_of_the_core_has_its_layer():
    rooms = {path.parts[1] for path in list_sources(CORE) if len(path.parts) > 2}
    assert rooms == {room for layer in LAYERS for room in layer}


def test_blender_rooms_import_only_what_they_may():
    assert all_complaints(extension_complaint, "scene", "operators", "panels") == []


def test_training_imports_only_what_it_may():
    assert all_complaints(training_complaint, "training") == []
    assert complaints(training_complaint, pathlib.Path("training/a.py"), "import sklearn")


def test_no_files_import_one_another_in_a_circle():
    assert find_cycles(build_file_graph()) == []
    assert find_cycles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == [["a", "b", "c"]]


def test_no_folder_is_crowded():
    counts = dict(count_files(CORE, "scene", "operators", "panels", "training", "benchmarks", "packaging"))
    assert {folder: count for folder, count in counts.items() if count > MAX_FILES} == {}


def test_the_picture_of_the_house_is_up_to_date():
    assert draw_architecture.PICTURE.read_text("utf-8") == draw_architecture.draw_architecture()


@pytest.mark.parametrize("path, text", [
    ("beyond_mocap/motion/a.py", "import bpy"),
    ("beyond_mocap/motion/a.py", "from ..library import features"),
    ("beyond_mocap/motion/a.py", "from .. import synthesis"),
    ("beyond_mocap/files/a.py", "from ..ball import flight"),
    ("beyond_mocap/ball/a.py", "from ..files.tables import number"),
    ("beyond_mocap/library/a.py", "import sklearn"),
    ("beyond_mocap/library/a.py", "from ..synthesis.plan import Plan"),
    ("beyond_mocap/synthesis/search/a.py", "from ...evaluation import report"),
    ("beyond_mocap/throws/a.py", "from ..passes.way import way"),
    ("beyond_mocap/markers/a.py", "from ..synthetic.ground_truth import planted"),
    ("beyond_mocap/study/a.py", "def f():\n    from ..match import make"),
    ("beyond_mocap/synthesis/plan.py", "from beyond_mocap.motion import track"),
    ("beyond_mocap/synthesis/a.py", "import pandas"),
])
def test_a_planted_offence_in_the_core_is_seen(path, text):
    assert len(complaints(core_complaint, pathlib.Path(path), text)) == 1


@pytest.mark.parametrize("path, text", [
    ("beyond_mocap/motion/a.py", "import numpy as np\nfrom . import quaternion\nfrom .skeleton import Skeleton"),
    ("beyond_mocap/library/a.py", "def f():\n    from sklearn.cluster import KMeans"),
    ("beyond_mocap/synthesis/construct/a.py", "from ...motion.limb import two_bone\nfrom ..plan import Plan"),
    ("beyond_mocap/match/a.py", "from ..passes.way import way\nfrom ..evaluation import report"),
    ("beyond_mocap/synthetic/ground_truth/a.py", "from ...markers.trial import MarkerTrial"),
    ("beyond_mocap/cli/a.py", "from .. import __version__"),
])
def test_what_is_allowed_in_the_core_passes(path, text):
    assert complaints(core_complaint, pathlib.Path(path), text) == []


@pytest.mark.parametrize("path, text", [
    ("panels/a.py", "from ..operators import synthesize"),
    ("panels/a.py", "from ..beyond_mocap.synthesis import plan"),
    ("panels/a.py", "from ..scene.passes import graph"),
    ("scene/core/a.py", "from ...operators import synthesize"),
    ("operators/a.py", "from beyond_mocap import plan"),
    ("operators/a.py", "import scipy"),
])
def test_a_planted_offence_in_the_extension_is_seen(path, text):
    assert len(complaints(extension_complaint, pathlib.Path(path), text)) == 1


def test_there_are_no_drawers():
    names = {part for path in list_sources(*PRODUCT, "tests")
             for part in (*path.parts[:-1], path.stem)}
    assert names & DRAWERS == set()


def test_nothing_is_unpickled_or_evaluated():
    offences = []
    for path in list_sources(*PRODUCT):
        text = (TOP / path).read_text("utf-8")
        offences += [i.where for i in read_imports(path, text) if i.name.split(".")[0] in FORBIDDEN]
        for node in list_nodes(text):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in {"eval", "exec"}:
                offences.append(f"{path}:{node.lineno}")
            if isinstance(node, ast.keyword) and node.arg == "allow_pickle" and getattr(node.value, "value", None):
                offences.append(f"{path}:{node.value.lineno}")
    assert offences == []


def test_archives_of_others_have_one_reader():
    """numpy's and zipfile's own unpack whatever a file says; maps, shipped files and a run's own pictures remain."""
    kept = {"beyond_mocap/files/motion_file.py", "beyond_mocap/appearance/template.py", "scene/stage/pictures.py"}
    readers = {(path.as_posix(), find_call) for path in list_sources(CORE, "scene", "operators", "panels", "training")
               for find_call in re.findall(r"\bnp\.load\(|\bZipFile\(", (TOP / path).read_text("utf-8"))}
    assert readers == {*((path, "np.load(") for path in kept), ("beyond_mocap/files/plain_npz.py", "ZipFile(")}


def test_the_extension_can_be_read_without_blender():
    path = pathlib.Path("__init__.py")
    imported = read_imports(path, (TOP / path).read_text("utf-8"))
    assert [i.where for i in imported if i.name.split(".")[0] in BLENDER and not i.lazy] == []
    assert [i.where for i in imported if i.relative and not i.lazy] == []


def test_one_version_everywhere():
    manifest = tomllib.loads((TOP / "blender_manifest.toml").read_text("utf-8"))
    project = tomllib.loads((TOP / "pyproject.toml").read_text("utf-8"))
    assert manifest["version"] == project["project"]["version"]


def test_links_in_the_docs_lead_somewhere():
    pages = [*TOP.glob("*.md"), *sorted((TOP / "docs").rglob("*.md"))]
    links = [(page, link) for page in pages for link in re.findall(r"\]\(([^)#\s]+)", page.read_text("utf-8"))]
    assert links
    assert [
        f"{page.name}: {link}" for page, link in links if "://" not in link and not (page.parent / link).exists()
    ] == []


def test_the_first_page_and_the_menu_lead_to_every_page():
    folder = TOP / "docs"
    pages = {path.relative_to(folder).as_posix() for path in folder.rglob("*.md")}
    assert {*re.findall(r"\]\(([^)#\s]+\.md)", (folder / "index.md").read_text("utf-8")), "index.md"} == pages
    assert set(re.findall(r"[\w./-]+\.md", (TOP / "mkdocs.yml").read_text("utf-8"))) == pages


def test_source_and_docs_cite_documents_of_the_repository_alone():
    paths = [*TOP.glob("*.md"), *sorted((TOP / "docs").rglob("*.md")), TOP / "Makefile"]
    paths += [TOP / path for path in list_sources(*PRODUCT, "tests")]
    cited, outside = 0, []
    for path in paths:
        text = " ".join(path.read_text("utf-8").split())
        outside += [f"{path.relative_to(TOP)}: {one}" for one in re.findall(r"\.\./shared/[\w-]+\.(?:md|txt)", text)]
        for page, section in re.findall(r"\b(docs/[\w/-]+\.md)(?:,? \(?\*([^*]+)\*)?", text):
            cited += 1
            found = (TOP / page).read_text("utf-8") if (TOP / page).is_file() else ""
            if not found or (section and not re.search(rf"^#+ {re.escape(section)}(?::|$)", found, re.M)):
                outside.append(f"{path.relative_to(TOP)}: {page} {section}")
    assert cited > 50 and outside == []
