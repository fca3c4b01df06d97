"""Ball & Passes in the window: strikes of a clip, the ball of a match, players who pass, and a ball that is carried."""

import shutil
import time

import bpy
import numpy as np
from tab import (
    PICTURES,
    assert_no_trouble_since,
    output,
    press,
    printed_since,
    room,
    run,
    sample,
    settings,
    settled,
    until,
    wait_for_work,
    window,
)  # fmt: skip

BEFORE = {}


def passes():
    """The passing scene's settings; looked up each time, since undo replaces them."""
    return window.window.scene.beyond_mocap_passes


def thing(name):
    """An object, by name."""
    return bpy.data.objects[name]


def own_tab(part):
    """One part of the panel alone in a tab of its own, so that its buttons are found quickly; returns what puts it
    back. part: name of the function that draws it."""
    kind = next(panel for panel in bpy.types.Panel.__subclasses__() if panel.__name__ == "BEYOND_MOCAP_PT_ball")
    was, draw, drawn = (kind.bl_category, kind.bl_options), kind.draw, getattr(room("panels.ball"), part)
    kind.draw = lambda self, context: drawn(
        *([self] if part in ("passing", "tracked", "live") else []), self.layout, context
    )

    def place(category, options):
        bpy.utils.unregister_class(kind)
        kind.bl_category, kind.bl_options = category, options
        bpy.utils.register_class(kind)

    def back():
        kind.draw = draw
        place(*was)

    place("Ball Check", set())
    yield from window.open_tab(window.area("VIEW_3D"), "Ball Check")
    return back


def places(name):
    """All values of an object's location keys."""
    data = thing(name).animation_data
    bag = data.action.layers[0].strips[0].channelbag(data.action_slot)
    found = []
    for curve in sorted((c for c in bag.fcurves if c.data_path == "location"), key=lambda c: c.array_index):
        values = np.empty(2 * len(curve.keyframe_points), np.float32)
        curve.keyframe_points.foreach_get("co", values)
        found.append(values[1::2])
    return np.array(found).T


def choose(*names):
    """Select these objects; the last is active."""
    for one in bpy.context.view_layer.objects:
        one.select_set(one.name in names)
    bpy.context.view_layer.objects.active = thing(names[-1])


def shown_hits(body):
    """Whether an armature's strikes are found and their graph is there."""
    hits = thing(body).beyond_mocap_hits
    return hits.found and room("scene.passes.settings").picture_icon(hits)


def check_hit_analysis_shows_a_graph_and_goes_to_strikes():
    mark = len(output.text())
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 1.0
    run("beyond_mocap.import_clips", "EXEC_DEFAULT", filepath=str(sample() / "library" / "kick_low_top.bvh"))
    body = bpy.context.object.name
    back = yield from own_tab("hits")
    yield from press("hit_analysis")
    yield from until(lambda: shown_hits(body), what="the graph of the hits")
    frame = int(thing(body).beyond_mocap_hits.lines.partition("\t")[0])
    yield from press("go_to_strike", f"frame={frame}")
    yield from until(lambda: window.window.scene.frame_current == frame)
    yield 0.5
    window.picture(PICTURES / "ball_hits.png")
    names = {marker.name for marker in thing(body).animation_data.action.pose_markers}
    assert names == {"hit from", "hit to", "hit right foot"}, names
    yield from window.move(window.area("VIEW_3D").x + 300, window.area("VIEW_3D").y + 300)
    yield from window.press("Z", ctrl=True)
    yield from window.press("Z", ctrl=True)
    yield from until(lambda: not thing(body).beyond_mocap_hits.found)
    yield from window.press("Z", ctrl=True, shift=True)
    yield from until(lambda: shown_hits(body), what="redo has a picture")
    back()
    assert_no_trouble_since(mark)


def check_the_ball_of_a_match_is_solved_and_accepted():
    mark = len(output.text())
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 1.0
    match = sample() / "match"
    run(
        "beyond_mocap.import_tracking", "EXEC_DEFAULT", directory=f"{match}/",
        files=[{"name": "player1.csv"}, {"name": "player2.csv"}],
    )
    for player in settings().players:  # without their words
        player.annotation_file = ""
        for track in list(player.dot.animation_data.nla_tracks):
            player.dot.animation_data.nla_tracks.remove(track)
    back = yield from own_tab("tracked")
    yield from press("solve_ball")
    yield from wait_for_work()
    found = [(touch.name, round(touch.time, 1)) for touch in passes().touches if touch.kind == "kick" and touch.name]
    output.say(f"     kicks solved: {found}")
    assert found == [("player1", 8.5), ("player2", 16.5), ("player1", 24.8)], found
    yield 0.5
    window.picture(PICTURES / "ball_solved.png")
    yield from press("accept_touches", "touches()")
    yield from settled()
    found = [moment.key.words for moment in room("scene.timeline.lanes").moments(settings().players["player2"].dot)]
    assert found == [("receive", "foot"), ("kick",)], (found, printed_since(mark)[-600:])
    back()
    assert_no_trouble_since(mark)


def few_clips():
    """A library that is built in a moment."""
    folder = PICTURES / "few_clips"
    folder.mkdir(exist_ok=True)
    for path in (sample() / "passes" / "library").iterdir():
        if path.stem.startswith(("volley_pass", "volley_toss", "volley_attack", "volley_receive", "ready",
                                 "walking_1_2", "standing_turn")):  # fmt: skip
            shutil.copy(path, folder)
    return str(folder.resolve())


def check_a_passing_scene_is_made_by_a_button():
    mark = len(output.text())
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 1.0
    bpy.context.scene.render.fps = 30
    run("beyond_mocap.passes_sample", "EXEC_DEFAULT", sample="three")
    passes().library_folder = few_clips()
    passes().repeat = 1
    back = yield from own_tab("passing")
    start = time.monotonic()
    yield from press("passes_make")
    yield from wait_for_work()
    output.say(f"     made in {time.monotonic() - start:.0f} s, the library built for the first time: "
               f"{', '.join(passes().figures.splitlines())}")
    assert passes().made_of and len(passes().strikes.splitlines()) == 4, passes().told
    for line in passes().strikes.splitlines():
        output.say(f"     {line}")
    scene, names = window.window.scene, [row.body.name for row in passes().players]
    assert len(set(names)) == 3
    frame = int(passes().strikes.splitlines()[1].partition("\t")[0])
    scene.frame_set(frame)
    view = window.area("VIEW_3D").spaces.active.region_3d
    view.view_perspective, view.view_distance, view.view_location = "PERSP", 12.0, (0.0, 0.0, 0.8)
    yield 1.0
    window.picture(PICTURES / "ball_scene.png")
    back()
    assert_no_trouble_since(mark)


def check_a_dragged_place_makes_the_scene_anew():
    mark = len(output.text())
    BEFORE.update(ball=places("Passing Ball"), made=passes().made_of, place=tuple(thing("Ann place").location))
    choose("Ann place")
    bpy.ops.ed.undo_push(message="before the drag")
    area = window.area("VIEW_3D")
    yield from window.move(area.x + 500, area.y + 400)
    yield from window.press("G")
    for step in range(12):
        yield from window.move(area.x + 500 + 6 * step, area.y + 400 + 4 * step)
    yield from window.press("LEFTMOUSE")
    start = time.monotonic()
    yield from until(lambda: passes().made_of != BEFORE["made"])
    yield from settled()  # a slow machine may have taken a halt on the way for the end
    output.say(f"     made anew {time.monotonic() - start:.1f} s after the hand rests")
    yield 0.5
    window.picture(PICTURES / "ball_dragged.png")
    now = places("Passing Ball")
    assert now.shape != BEFORE["ball"].shape or np.abs(now - BEFORE["ball"]).max() > 0.05, "the ball goes the same way"
    frame = int(passes().strikes.splitlines()[0].partition("\t")[0])
    window.window.scene.frame_set(frame)
    yield 0.3
    place = np.array(thing("Ann place").matrix_world.translation)[:2]
    hips = thing(passes().players["Ann"].body.name)
    hips = np.array((hips.matrix_world @ hips.pose.bones[0].matrix).translation)[:2]
    assert np.linalg.norm(place - hips) < 0.8, (place, hips)
    yield from window.press("Z", ctrl=True)
    yield from settled()
    assert passes().made_of == BEFORE["made"] and np.array_equal(
        places("Passing Ball"), BEFORE["ball"]
    ), "undo is another scene"
    yield from window.press("Z", ctrl=True)
    yield from settled()
    assert np.allclose(
        thing("Ann place").location, BEFORE["place"], atol=1e-6
    ), "the second undo does not take the drag back"
    assert passes().made_of == BEFORE["made"]
    assert_no_trouble_since(mark)


def check_bounces_are_changed_and_nonsense_is_told():
    mark, before = len(output.text()), passes().made_of
    passes().passes[0].bounces = 0
    yield from until(lambda: passes().made_of != before)
    yield from settled()
    before = passes().made_of
    passes().passes[0].to = passes().passes[0].who
    yield from until(lambda: "both passer and receiver" in passes().told)
    yield from settled()
    assert passes().made_of == before
    passes().passes[0].to = "Ben"
    yield 1.0
    yield from settled()
    assert passes().made_of == before
    assert_no_trouble_since(mark)


def check_a_hand_carries_the_ball():
    mark = len(output.text())
    body = passes().players["Cho"].body.name
    last = int(passes().strikes.splitlines()[-1].partition("\t")[0])
    choose("Passing Ball", body)
    passes().hold_first, passes().hold_last = last + 8, last + 38
    back = yield from own_tab("carried")
    yield from press("take_ball")
    yield from until(lambda: len(thing("Passing Ball").constraints) == 1)
    ball = thing("Passing Ball")
    assert len(ball.beyond_mocap_ball.holds) == 1
    at = []
    for frame in range(last + 4, last + 42):
        window.window.scene.frame_set(frame)
        at.append(np.array(ball.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.translation))
    steps = np.linalg.norm(np.diff(at, axis=0), axis=1)
    output.say(f"     carried: the ball moves {steps.max():.2f} m between two frames at most")
    assert steps.max() < 0.9, steps
    yield 0.3
    window.picture(PICTURES / "ball_carried.png")
    yield from press("free_ball")
    yield from until(lambda: not len(thing("Passing Ball").constraints))
    back()
    assert_no_trouble_since(mark)
