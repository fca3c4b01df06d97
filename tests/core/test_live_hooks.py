"""One module listens to Blender, one hangs things over its windows: what else would be left when the extension goes."""

import ast
import pathlib

import pytest

from architecture import list_nodes

TOP = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = ("scene", "operators", "panels", "sample_blend")
LISTENS = ("scene/core/live.py", ("bpy.app.handlers", "bpy.app.timers", "bpy.msgbus"))
OTHER_PROCESS = "scene/stage/render_child.py"  # runs without the extension, in a process that ends: nothing is left
HANGS = ("scene/core/window.py", ("draw_handler_add", "draw_handler_remove", "event_timer_add", "event_timer_remove"))


def names_of(text):
    """(line, dotted name) of everything that is imported or looked up in a file's text."""
    for node in list_nodes(text):
        if isinstance(node, ast.ImportFrom):
            yield from ((node.lineno, f"{node.module}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, (ast.Attribute, ast.Name)):
            yield node.lineno, ast.unparse(node)


def hooks_in(path, text):
    """Where a file hooks into Blender by itself."""
    return sorted({
        f"{path}:{line}: {known}" for owner, hooks in (LISTENS, HANGS) if path != owner for line, name in names_of(text)
        for known in hooks if f".{known}." in f".{name}."
    })


def test_nothing_else_hooks_into_blender():
    paths = [TOP / "__init__.py", TOP / "batch.py", *(path for name in FOLDERS for path in (TOP / name).rglob("*.py"))]
    paths.remove(TOP / OTHER_PROCESS)
    found = [line for path in paths for line in hooks_in(path.relative_to(TOP).as_posix(), path.read_text("utf-8"))]
    assert len(paths) > 150 and found == []


@pytest.mark.parametrize("text", [
    "import bpy\nbpy.app.timers.register(f)",
    "from bpy.app import timers",
    "from bpy.app.handlers import persistent",
    "import bpy\nadd = bpy.app.handlers.load_post.append",
    "import bpy\nbpy.msgbus.subscribe_rna(key=k)",
    "bpy.types.SpaceView3D.draw_handler_add(f, (), 'WINDOW', 'POST_PIXEL')",
    "context.window_manager.event_timer_add(0.1, window=None)",
])
def test_a_planted_hook_is_seen(text):
    assert hooks_in("scene/a.py", text) and not hooks_in("scene/a.py", "import bpy\nbpy.app.background")


def test_the_owners_do_hook():
    assert all(hooks_in("elsewhere.py", (TOP / owner).read_text("utf-8")) for owner, _ in (LISTENS, HANGS))
