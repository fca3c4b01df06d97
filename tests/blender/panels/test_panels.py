"""What the tab draws: nothing is cut at the width that Blender gives it at first, and main buttons stay in their place
while work runs and after it. All panels are drawn into a layout that writes down what it is told, all sections open."""

import importlib
import inspect
import re
from types import SimpleNamespace

import bpy
import pytest
from conftest import EXTENSION
from fake_layout import FakeLayout, list_cut

MAIN = {  # panel -> operators whose place is not to change
    "library_step": ("build_library",),
    "library": ("build_library",),
    "synthesis": ("synthesize", "update"),
    "result": ("accept", "discard"),
    "rig": ("bake_to_rig",),
    "match": ("read_match",),
}
QUALITY = "\n".join(("Foot slide: 3.5 cm/s\t≤ 3.2\tmissed", "Lean at starts and stops off: 5.0°\t≤ 3.0\tmissed",
                     "Knee flexion in sprints: 127°\t139 .. 151\tmissed",
                     "Fall in flight, 4 to 6 m/s: -7.8 m/s²\t-10.8 .. -8.8\tmissed",
                     "Ball inside the body: 12 frames\t≤ 0\tmissed"))
WARNINGS = "15.3-15.5 s: hardly any steps sideways or diagonally at 0.5 to 1.5 m/s: add some\t15.267"


class FakePanel:
    """Stands in for a panel that is drawn into a layout."""

    def __init__(self, cls, layout):
        vars(self).update(_cls=cls, layout=layout)

    def __getattr__(self, name):
        found = inspect.getattr_static(self._cls, name)
        return found.__get__(self) if inspect.isfunction(found) else getattr(self._cls, name)


@pytest.fixture
def context(extension, monkeypatch):
    """Blender's context with a sidebar at a scale of 1."""
    scale = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    own = SimpleNamespace(region=SimpleNamespace(width=280.0), preferences=scale, object=bpy.context.object,
                          scene=bpy.context.scene, window_manager=bpy.context.window_manager, mode="OBJECT",
                          view_layer=bpy.context.view_layer, selected_objects=[], space_data=None)
    tab = importlib.import_module(f"{EXTENSION}.panels.tab")
    monkeypatch.setattr(tab, "bpy", SimpleNamespace(context=own, types=bpy.types))
    return own


def list_panels():
    """The panels of the 3D view's tab."""
    return [cls for cls in bpy.types.Panel.__subclasses__() if cls.__module__.startswith(EXTENSION)
            and cls.bl_space_type == "VIEW_3D" and cls.is_registered and hasattr(cls, "task")]


def draw(cls, context):
    """Draw a panel; return its layout."""
    layout = FakeLayout()
    cls.draw(FakePanel(cls, layout), context)
    return layout


def find_panel(name):
    return next(cls for cls in list_panels() if cls.__name__ == f"BEYOND_MOCAP_PT_{name}")


def fill_scene(scene):
    """A player with a take, a match, a passing scene: so much that most of the panels is drawn."""
    settings = scene.beyond_mocap
    settings.library_folder, settings.library_holds = "//library", "43 clips, 4.7 minutes, 22 joints\nJogging: 2.9 m/s"
    player = settings.players.add()
    player.name, player.take, player.result.state = "player1", "take", "PREVIEW"
    player.quality, player.warnings = QUALITY, WARNINGS
    player.moments = "8.5 s  kick right running low inside, touch at 8.49 s\t8.500\tmet"
    bpy.ops.beyond_mocap.passes_sample(sample="three")
    one = scene.beyond_mocap_match.players.add()
    one.name, one.number = "Somebody", 7
    body = bpy.data.objects.new("Body", bpy.data.armatures.new("Body"))
    scene.collection.objects.link(body)
    bpy.context.view_layer.objects.active = body


@pytest.mark.parametrize("filled", [False, True])
def test_nothing_is_cut(context, filled):
    if filled:
        fill_scene(bpy.context.scene)
    cut = {cls.__name__: found for cls in list_panels() if (found := list_cut(draw(cls, context)))}
    assert not cut, "\n".join(f"{name}: {text!r} has {room:.0f}, needs {needed:.0f}"
                              for name, rows in cut.items() for text, room, needed in rows)


def test_a_cut_text_would_be_found():
    layout = FakeLayout()
    layout.row().operator("beyond_mocap.cancel", text="a text that no sidebar has the room for, whoever looks at it")
    layout.split(factor=0.5).label(text="half of the width is too little")
    assert len(list_cut(layout)) == 2


@pytest.mark.parametrize("name", MAIN)
def test_main_buttons_stay_where_they_are(context, name):
    """What is drawn before them is the same whatever runs, is out of date, or has gone wrong."""
    scene, manager = bpy.context.scene, bpy.context.window_manager
    fill_scene(scene)
    idle = list_before(name, context, MAIN[name])
    assert None not in idle
    running = manager.beyond_mocap_work
    running.kind, running.text, running.waiting, running.trouble = "synthesis", "player1: Searching", "a\nb", "failed"
    stale = manager.beyond_mocap_stale.add()
    stale.name, stale.scene, stale.lines, stale.mend = "player1", scene.session_uid, "the track", "update"
    scene.beyond_mocap.rig.messages = "a message"
    scene.beyond_mocap.rig.target = bpy.context.view_layer.objects.active
    manager.beyond_mocap_clips.missing = name == "library"
    try:
        assert list_before(name, context, MAIN[name]) == idle
    finally:
        running.kind = running.text = running.waiting = running.trouble = ""
        manager.beyond_mocap_stale.clear()
        manager.beyond_mocap_clips.missing = False


def list_before(name, context, operators):
    """Of each main button the number of rows drawn above it; None where it is not drawn."""
    layout = draw(find_panel(name), context)
    flat = list(iter_rows(layout))
    places = []
    for operator in operators:
        sought = f"beyond_mocap.{operator}:"
        places.append(next((number for number, texts in enumerate(flat)
                            if any(text.startswith(sought) for text in texts)), None))
    return places


def iter_rows(layout):
    """Iterate over the texts of each row, from above."""
    if not isinstance(layout, FakeLayout):
        yield [layout.text]
    elif layout.kind in ("row", "header", "split"):
        yield [text for child in layout.children for row in iter_rows(child) for text in row]
    else:
        for child in layout.children:
            yield from iter_rows(child)


@pytest.mark.parametrize("kind, name, operator", [
    ("library", "library_step", "build_library"), ("passes", "ball", "passes_make"), ("ball", "ball", "solve_ball"),
    ("match", "match", "make_match"), ("match file", "match", "read_match")])
def test_progress_stands_where_the_button_was(context, kind, name, operator):
    fill_scene(bpy.context.scene)
    place, = list_before(name, context, [operator])
    try:
        running = bpy.context.window_manager.beyond_mocap_work
        running.kind, running.text = kind, "Working 41 %, about 6 s left"
        rows = list(iter_rows(draw(find_panel(name), context)))
        assert rows[place] == ["Working 41 %, about 6 s left", "beyond_mocap.cancel:"]
    finally:
        bpy.context.window_manager.beyond_mocap_work.kind = ""


def test_each_task_shows_its_own_panels(context):
    settings = bpy.context.scene.beyond_mocap
    assert settings.task == "PLAYER"
    fill_scene(bpy.context.scene)
    for task in ("PLAYER", "MATCH", "PATH", "BALL", "MARKERS", "LIBRARY"):
        settings.task = task
        shown = {cls.__name__ for cls in list_panels() if cls.poll(context)}
        assert shown == {cls.__name__ for cls in list_panels() if cls.task in ("", task) or task in cls.also}
        assert {"BEYOND_MOCAP_PT_task", "BEYOND_MOCAP_PT_view"} < shown and len(shown) > 3


def test_every_line_of_a_warning_can_be_pressed(context):
    """Only the first of the rows of a wrapped warning went to its time."""
    fill_scene(bpy.context.scene)
    layout = draw(find_panel("quality"), context)
    jumps = [text for kind, text in layout.drawn if text.startswith("beyond_mocap.jump_to:")]
    shown = " ".join(text.partition(":")[2] for text in jumps)
    assert WARNINGS.partition("\t")[0] in shown and len(jumps) > 3


def test_zero_is_shown_as_automatic(context):
    fill_scene(bpy.context.scene)
    player = bpy.context.scene.beyond_mocap.players[0]
    assert player.height == 0.0
    assert ("operator", "beyond_mocap.set_automatic:Automatic") in draw(find_panel("players"), context).drawn
    path = player.path_from_id("height")
    assert bpy.ops.beyond_mocap.set_automatic(path=path, value=1.8) == {"FINISHED"}
    assert player.height == pytest.approx(1.8)
    drawn = draw(find_panel("players"), context).drawn
    assert ("name", "Height") in drawn and ("operator", "beyond_mocap.set_automatic:") in drawn
    assert bpy.ops.beyond_mocap.set_automatic(path=path) == {"FINISHED"}
    assert player.height == 0.0


def test_landmarks_are_shown_in_plain_words(context):
    bpy.ops.object.select_all(action="DESELECT")
    cloud = bpy.data.objects.new("Cloud", bpy.data.meshes.new("Cloud"))
    label = cloud.beyond_mocap_cloud.labels.add()
    label.landmark = "left_temple, c7"
    assert label.landmark_words == "Left Temple, C7"
    label.landmark_words = "Right Temple"
    assert label.landmark == "right_temple"


def test_no_identifiers_are_shown(context):
    fill_scene(bpy.context.scene)
    texts = [text.partition(":")[2] if kind == "operator" else text for cls in list_panels()
             for kind, text in draw(cls, context).drawn if kind in ("label", "operator", "enum", "name")]
    assert not [text for text in texts if re.search(r"[a-z]_[a-z]", text)]
