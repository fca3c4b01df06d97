"""What the tab draws: nothing is cut at the width that Blender gives it at first, and main buttons stay in their place
while work runs and after it. All panels are drawn into a layout that writes down what it is told, all sections open."""

import re
from types import SimpleNamespace

import bpy
import pytest
from fake_layout import FakeLayout, FakePanel, create_context, draw, list_cut, list_cut_panels, list_panels

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


@pytest.fixture
def context(extension, monkeypatch):
    """Blender's context with a sidebar at a scale of 1."""
    return create_context(monkeypatch)


def find_panel(name):
    return next(cls for cls in list_panels() if cls.__name__ == f"BEYOND_MOCAP_PT_{name}")


def fill_scene(scene):
    """A player with a take, a match, a passing scene: so much that most of the panels is drawn."""
    settings = scene.beyond_mocap
    settings.library_folder, settings.library_holds = "//library", "43 clips, 4.7 minutes, 22 joints\nJogging: 2.9 m/s"
    settings.library_gaps = "3 warnings: Clips without labels, 2 motions missing\n1 clip has no labels"
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
    body.beyond_mocap_ride.on, body.beyond_mocap_throw.made = True, "take"


@pytest.mark.parametrize("filled", [False, True])
def test_nothing_is_cut(context, filled):
    if filled:
        fill_scene(bpy.context.scene)
    assert not list_cut_panels(context)


def test_missed_moments_are_in_the_step_of_synthesize(context):
    settings = bpy.context.scene.beyond_mocap
    for number in range(1, 7):
        player = settings.players.add()
        player.name, player.moments = f"p{number}", "1.0 s  kick\t1.0\tmet\n2.0 s  kick\t2.0\tmissed"
    settings.players[0].use = False
    texts = [text for _, text in draw(find_panel("synthesis"), context).drawn]
    assert "p1: 1 of 2 moments missed" not in texts and "p2: 1 of 2 moments missed" in texts
    assert "and 1 more players" not in texts and "and 1 more" in texts


@pytest.mark.parametrize("name, line", [
    ("library", "Choose the folder of your"), ("match", "Choose the library's folder"),
    ("ball", "Add two players and a pass"), ("path", "Nudging moves points:")])
def test_a_greyed_button_says_why_in_the_panel(context, name, line):
    scene = bpy.context.scene
    scene.beyond_mocap_match.players.add().name = "A player"
    assert any(text.startswith(line) for _, text in draw(find_panel(name), context).drawn)
    fill_scene(scene)
    if name != "path":  # its curve is not in Edit Mode
        assert not any(text.startswith(line) for _, text in draw(find_panel(name), context).drawn)


def test_the_closed_panel_of_a_throw_shows_its_figures(context):
    fill_scene(bpy.context.scene)
    bpy.context.object.beyond_mocap_throw.figures = "Release frame: 60.0\nBall speed: 15.0 m/s\nTarget error: 3.2 cm"
    context.object, layout = bpy.context.object, FakeLayout()
    find_panel("throws").draw_header_preset(FakePanel(find_panel("throws"), layout), context)
    assert layout.drawn == [("label", "15.0 m/s, 3.2 cm off")]


def test_a_cut_text_would_be_found():
    layout = FakeLayout()
    layout.row().operator("beyond_mocap.cancel", text="a text that no sidebar has the room for, whoever looks at it")
    layout.split(factor=0.5).label(text="half of the width is too little")
    row = layout.row()
    row.label(text="as wide as the short one")
    row.label(text="short")
    assert len(list_cut(layout)) == 3


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


def test_progress_keeps_its_share_and_time_where_there_is_little_room(context):
    fill_scene(bpy.context.scene)
    running = bpy.context.window_manager.beyond_mocap_work
    texts = {"passes": ("Clustering blocks of 32 frames", "Clustering…"), "library": ("Reading walk_1.bvh", "Reading…"),
             "synthesis": ("player1: Searching", "player1: Searching")}
    try:
        for kind, (text, short) in texts.items():
            running.kind, running.text = kind, f"{text} 80 %, about 10 s left"
            drawn = [bar for cls in list_panels() for what, bar in draw(cls, context).drawn if what == "progress"]
            assert f"{short} 80 %, about 10 s left" in drawn
            assert not list_cut_panels(context)
    finally:
        running.kind = ""


def test_a_sample_s_progress_stands_where_its_button_was(context):
    running, task = bpy.context.window_manager.beyond_mocap_work, find_panel("task")
    context.scene.beyond_mocap.task = "BALL"
    rows = list(iter_rows(draw(task, context)))
    place = next(number for number, texts in enumerate(rows) if any("load_sample" in text for text in texts))
    try:
        running.kind, running.text = "throw", "Generating 41 %"
        assert list(iter_rows(draw(task, context)))[place] == rows[place]
        context.window.modal_operators.append(SimpleNamespace(bl_idname="BEYOND_MOCAP_OT_load_sample"))
        assert list(iter_rows(draw(task, context)))[place] == ["Generating 41 %", "beyond_mocap.cancel:"]
    finally:
        running.kind = ""


def test_each_task_shows_its_own_panels(context):
    settings = bpy.context.scene.beyond_mocap
    assert settings.task == "PLAYER"
    fill_scene(bpy.context.scene)
    for task in ("PLAYER", "MATCH", "PATH", "BALL", "MARKERS", "LIBRARY"):
        settings.task = task
        shown = {cls.__name__ for cls in list_panels() if cls.poll(context)}
        assert shown <= {cls.__name__ for cls in list_panels() if cls.task in ("", task) or task in cls.also}
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
