"""No product file compares labels by name: what they mean comes from one table."""

import ast
import pathlib

from architecture import list_nodes
from beyond_mocap.annotation import labels

TOP = pathlib.Path(__file__).parents[2]
SYNTHETIC = {  # builders of motions and matches, each of certain labels
    *(f"beyond_mocap/synthetic/{name}.py" for name in ("gait", "gait_tables", "gestures", "kicks", "moves", "volleys")),
    "beyond_mocap/synthetic/kick_styles.py", "beyond_mocap/synthetic/recorded_kicks.py",
    "beyond_mocap/synthetic/ground_truth/synthetic_match.py", "beyond_mocap/library/synthetic_clips.py",
    "beyond_mocap/synthetic/actions/table.py", "beyond_mocap/synthetic/actions/receptions.py",
    "beyond_mocap/library/receptions.py", "beyond_mocap/synthetic/recorded_kicks.py",
    "beyond_mocap/throws/synthetic_examples.py",
}  # fmt: skip
PACKAGES_OF_LABELS = ("beyond_mocap/annotation/", "beyond_mocap/synthetic/actions/")
ALLOWED = {
    "beyond_mocap/passes/strike_choice.py": "a volley by hand is a volleyball player's, which no single label says",
    "beyond_mocap/library/landings.py": "is about getting up",
    "beyond_mocap/files/event_providers.py": "providers' kinds of events",
    "beyond_mocap/match/pieces/pool.py": "a cluster that is running",
    "beyond_mocap/library/common_skeleton.py": "arguments by name",
    "beyond_mocap/evaluation/touch_figures.py": "a group of figures",
}
DOES = ("act", "action")
SAID_OTHERWISE = {"block", "pass", "throw", "serve", "catch", "save", "jump", "tackle"}


def compared(text, known):
    """Literals of `known` that the code compares, or has in a set or as a dict's keys; what networks do left out."""
    found = []
    for node in list_nodes(text):
        parts = []
        if isinstance(node, ast.Compare) and getattr(node.left, "attr", getattr(node.left, "id", "")) not in DOES:
            parts = [node.left, *node.comparators]
            parts += [cell for part in parts if isinstance(part, (ast.Tuple, ast.List)) for cell in part.elts]
        elif isinstance(node, (ast.Set, ast.Dict)):
            parts = node.elts if isinstance(node, ast.Set) else node.keys
        said = [part.value for part in parts if isinstance(part, ast.Constant)]
        found += [value for value in said if value in known and set(said) != set(labels.ACTIONS)]
    return found


def test_no_product_file_compares_labels_by_name():
    known = {label.name for label in labels.read_labels().values() if label.is_root or label.ball} - SAID_OTHERWISE
    offences = {}
    for folder in ("beyond_mocap", "scene", "operators", "panels"):
        for path in (TOP / folder).rglob("*.py"):
            name = path.relative_to(TOP).as_posix()
            if not name.startswith(PACKAGES_OF_LABELS) and name not in SYNTHETIC:
                offences[name] = compared(path.read_text(), known)
    assert {name for name, found in offences.items() if found} == set(ALLOWED)
    assert compared('x = word in {"kick", "hand"} or word == "receive"', known) == ["receive", "kick"]
