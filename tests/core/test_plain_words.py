"""The program speaks the terms of the field (docs/glossary.md): no forbidden words, functions named by verb and
object; and examples in documents import what is there."""

import ast
import re
from importlib import import_module
from pathlib import Path

import pytest

from architecture import list_nodes

TOP = Path(__file__).resolve().parents[2]
CODE = ("beyond_mocap", "scene", "operators", "panels", "packaging", "sample_blend", "benchmarks", "training")
ROOMS = ("beyond_mocap", "scene", "operators", "panels")
FORBIDDEN = {
    "told": (r"\btold\b|_told\b|\btold_", 8),  # keys of files that 0.1 wrote keep the word
    "anew": (r"\banew\b", 0),
    "nobody": (r"\b(?:nobody|somebody|whoever|everybody)\b", 0),
    "he": (r"\b(?:he|his|him)\b", 0),
    "mend": (r"\bmend(?:s|ed|ing)?\b", 9),  # a property of panels, and the cleaner's report, keep the word
    "idiom": (r"\bgives? way\b|\bput right\b|\bmakes no sense\b|\bdearest\b|\bnumbers that are none\b|\bfootage\b", 0),
}
"""Word -> its pattern, and how often it may occur in product code and documents together."""
PARTICIPLES = {
    "begun", "bent", "bound", "built", "cut", "drawn", "drunk", "fed", "felt", "flown", "found", "given", "gone",
    "grown", "held", "kept", "known", "laid", "led", "left", "lost", "made", "met", "once", "put", "ridden", "risen",
    "said", "seen", "sent", "shown", "spent", "spoken", "stood", "taken", "thrown", "told", "torn", "worn", "written",
}  # fmt: skip
NOUNS = {"seed", "speed", "feed", "bed", "need"}
"""What ends like a participle and is none."""


COMMANDS_OWN = {"evaluation/two_sample_test/windows.py", "evaluation/methods/comparison.py", "files/freeze_frames.py",
                "match/pieces/pool.py", "match/state.py"}
"""Files of the core with flags in messages: what only the command line runs, Blender's own option, and a step that
panels replace."""


def list_documents():
    found = [TOP / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]
    return [*found, TOP / "beyond_mocap" / "annotation" / "vocabulary.csv", *sorted((TOP / "docs").rglob("*.md"))]


def list_sources(*folders):
    return [path for folder in folders for path in sorted((TOP / folder).rglob("*.py"))]


def count_words(text, word):
    return len(re.findall(FORBIDDEN[word][0], text, re.IGNORECASE))


def function_names(paths):
    """Distinct names of functions and methods, those with two underscores in front left out."""
    found = set()
    for path in paths:
        nodes = list_nodes(path.read_text("utf-8"))
        found |= {node.name for node in nodes if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))}
    return {name for name in found if not name.startswith("__")}


def is_one_word(name):
    return "_" not in name.strip("_")


def is_participle(name):
    word = name.strip("_")
    return is_one_word(name) and word not in NOUNS and (word in PARTICIPLES or (word.endswith("ed") and len(word) > 3))


@pytest.mark.parametrize("word", FORBIDDEN)
def test_product_and_documents_avoid_the_words_that_readers_do_not_search_for(word):
    paths = [*list_sources(*CODE), TOP / "batch.py", TOP / "__init__.py", *list_documents()]
    found = {path.relative_to(TOP).as_posix(): count_words(path.read_text("utf-8"), word) for path in paths}
    found = {path: count for path, count in found.items() if count}
    assert sum(found.values()) <= FORBIDDEN[word][1], found


def test_what_documents_import_is_there():
    """A name that moved to another module leaves no example behind."""
    form = re.compile(r"^ *from (beyond_mocap[\w.]*) import ([\w, ]+)$", re.M)
    found = {one for path in list_documents() for one in form.findall(path.read_text("utf-8"))}
    missing = [(module, name) for module, names in sorted(found) for name in names.split(", ")
               if not hasattr(import_module(module), name)]
    assert len(found) > 20 and not missing


def test_at_most_three_in_ten_functions_of_the_core_have_one_word_and_none_anywhere_is_a_bare_participle():
    names = function_names(list_sources("beyond_mocap"))
    single = {name for name in names if is_one_word(name)}
    assert len(single) <= 0.3 * len(names), sorted(single)
    assert {name for name in function_names(list_sources(*ROOMS)) if is_participle(name)} == set()


def test_more_than_a_fifth_of_the_core_is_documentation():
    lines = documented = 0
    for path in list_sources("beyond_mocap"):
        text = path.read_text("utf-8")
        lines += text.count("\n")
        documented += sum(line.lstrip().startswith("#") for line in text.splitlines())
        for node in list_nodes(text):
            if isinstance(node, (ast.FunctionDef, ast.ClassDef, ast.Module)) and ast.get_docstring(node) is not None:
                documented += node.body[0].end_lineno - node.body[0].lineno + 1
    assert documented >= 0.22 * lines


@pytest.mark.parametrize(("text", "word", "count"), [
    ("the user is told", "told", 1), ("def told_lines():", "told", 1), ("untold", "told", 0),
    ("Anew and anew", "anew", 2), ("nobody, Whoever", "nobody", 2), ("the help here", "he", 0),
    ("He runs his way", "he", 2), ("amended", "mend", 0),
])
def test_planted_words_are_counted(text, word, count):
    assert count_words(text, word) == count


@pytest.mark.parametrize(("name", "answer"), [
    ("told", True), ("_named", True), ("speed", False), ("plant_feet", False), ("seed", False), ("shown", True),
    ("mirror", False), ("cut", True), ("once", True), ("limited", True), ("_drawn", True),
])
def test_planted_participles_are_seen(name, answer):
    assert is_participle(name) == answer


def iter_texts(node):
    """Texts below a node of the syntax tree, docstrings left out."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Constant) and isinstance(child.value, str) and not isinstance(node, ast.Expr):
            yield child.value
        yield from iter_texts(child)


def test_messages_that_panels_show_name_no_flags():
    core = TOP / "beyond_mocap"
    flag = re.compile(r"(?<!\S)--[a-z]")
    texts = {path: path.read_text("utf-8") for path in list_sources("beyond_mocap")}
    found = {path.relative_to(core).as_posix() for path, text in texts.items()
             if re.search("--[a-z]", text) and any(map(flag.search, iter_texts(ast.parse(text))))}
    of_commands = {name for name in found if name.startswith(("cli/", "base/settings/"))}
    assert "cli/matching.py" in of_commands
    assert found - of_commands == COMMANDS_OWN
