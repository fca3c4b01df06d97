"""Ball & Passes in the window: strikes of a clip, the ball of a match, players who pass, and a ball that is carried."""

import shutil
import time

import bpy
import numpy as np
from tab import (
    PICTURES,
    assert_no_errors_since,
    click_operator,
    copy_sample,
    get_settings,
    import_module,
    open_task,
    output,
    read_printed_since,
    run_operator,
    wait_for_work,
    wait_until,
    wait_until_settled,
    window,
)  # fmt: skip

BEFORE = {}


def get_passes():
    """The passing scene's settings; looked up each time, since undo replaces them."""
    return window.window.scene.beyond_mocap_passes


def find_object(name):
    """An object, by name."""
    return bpy.data.objects[name]


def isolate_panel(part):
    """One part of the panel alone in a tab of its own, so that its buttons are found quickly; returns what puts it
    back. part: name of the function that draws it."""
    name = "stream" if part in ("draw_streams", "draw_play_live") else "ball"
    kind, drawn = (getattr(import_module(f"panels.{name}"), one) for one in (f"BEYOND_MOCAP_PT_{name}", part))
    was, draw = (kind.bl_category, getattr(kind, "bl_options", set())), kind.draw
    kind.draw = lambda self, context: drawn(self.layout, context)

    def place_panel(category, options):
        bpy.utils.unregister_class(kind)
        kind.bl_category, kind.bl_options = category, options
        bpy.utils.register_class(kind)

    def restore_panels():
        kind.draw = draw
        place_panel(*was)

    yield from open_task(kind.task)
    place_panel("Ball Check", set())
    yield from window.open_tab(window.find_area("VIEW_3D"), "Ball Check")
    return restore_panels


def list_positions(name):
    """All values of an object's location keys."""
    data = find_object(name).animation_data
    bag = data.action.layers[0].strips[0].channelbag(data.action_slot)
    found = []
    for curve in sorted((c for c in bag.fcurves if c.data_path == "location"), key=lambda c: c.array_index):
        values = np.empty(2 * len(curve.keyframe_points), np.float32)
        curve.keyframe_points.foreach_get("co", values)
        found.append(values[1::2])
    return np.array(found).T


def select_objects(*names):
    """Select these objects; the last is active."""
    for one in bpy.context.view_layer.objects:
        one.select_set(one.name in names)
    bpy.context.view_layer.objects.active = find_object(names[-1])


def has_hit_graph(body):
    """Whether an armature's strikes are found and their graph is there."""
    hits = find_object(body).beyond_mocap_hits
    return hits.found and import_module("scene.passes.settings").find_picture_icon(hits)


def check_hit_analysis_shows_a_graph_and_goes_to_strikes():
    mark = len(output.text())
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 1.0
    run_operator("beyond_mocap.import_clips", "EXEC_DEFAULT",
                 filepath=str(copy_sample() / "library" / "kick_low_top.bvh"))
    body = bpy.context.object.name
    back = yield from isolate_panel("draw_hit_analysis")
    yield from click_operator("hit_analysis")
    yield from wait_until(lambda: has_hit_graph(body), what="the graph of the hits")
    frame = int(find_object(body).beyond_mocap_hits.lines.partition("\t")[0])
    yield from click_operator("go_to_strike", f"frame={frame}")
    yield from wait_until(lambda: window.window.scene.frame_current == frame)
    yield 0.5
    window.save_picture(PICTURES / "ball_hits.png")
    names = {marker.name for marker in find_object(body).animation_data.action.pose_markers}
    assert names == {"hit from", "hit to", "hit right foot"}, names
    yield from window.move_pointer(window.find_area("VIEW_3D").x + 300, window.find_area("VIEW_3D").y + 300)
    yield from window.press_key("Z", ctrl=True)
    yield from window.press_key("Z", ctrl=True)
    yield from wait_until(lambda: not find_object(body).beyond_mocap_hits.found)
    yield from window.press_key("Z", ctrl=True, shift=True)
    yield from wait_until(lambda: has_hit_graph(body), what="redo has a picture")
    back()
    assert_no_errors_since(mark)


def check_the_ball_of_a_match_is_solved_and_accepted():
    mark = len(output.text())
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 1.0
    match = copy_sample() / "match"
    run_operator(
        "beyond_mocap.import_tracking", "EXEC_DEFAULT", directory=f"{match}/",
        files=[{"name": "player1.csv"}, {"name": "player2.csv"}],
    )
    for player in get_settings().players:  # without their words
        player.annotation_file = ""
        for track in list(player.dot.animation_data.nla_tracks):
            player.dot.animation_data.nla_tracks.remove(track)
    back = yield from isolate_panel("draw_tracked_ball")
    yield from click_operator("solve_ball")
    yield from wait_for_work()
    found = [(touch.name, round(touch.time, 1)) for touch in get_passes().touches if touch.kind == "kick"
             and touch.name]
    output.write_line(f"     kicks solved: {found}")
    assert found == [("player1", 8.5), ("player2", 16.5), ("player1", 24.8)], found
    yield 0.5
    window.save_picture(PICTURES / "ball_solved.png")
    yield from click_operator("accept_touches", "touches()")
    yield from wait_until_settled()
    found = [moment.key.words for moment in import_module("scene.timeline.label_tracks").list_moments(
        get_settings().players["player2"].dot)]
    assert found == [("receive", "foot"), ("kick",)], (found, read_printed_since(mark)[-600:])
    back()
    assert_no_errors_since(mark)


def copy_few_clips():
    """A library that is built in a moment."""
    folder = PICTURES / "few_clips"
    folder.mkdir(exist_ok=True)
    for path in (copy_sample() / "passes" / "library").iterdir():
        if path.stem.startswith(("volley_pass", "volley_toss", "volley_attack", "volley_receive", "ready",
                                 "walking_1_2", "standing_turn")):  # fmt: skip
            shutil.copy(path, folder)
    return str(folder.resolve())


def check_a_passing_scene_is_generated_by_a_button():
    mark = len(output.text())
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 1.0
    bpy.context.scene.render.fps = 30
    run_operator("beyond_mocap.passes_sample", "EXEC_DEFAULT", sample="three")
    get_passes().library_folder = copy_few_clips()
    get_passes().repeat = 1
    back = yield from isolate_panel("draw_passing_scene")
    start = time.monotonic()
    yield from click_operator("passes_make")
    yield from wait_for_work()
    output.write_line(f"     made in {time.monotonic() - start:.0f} s, the library built for the first time: "
                      f"{', '.join(get_passes().figures.splitlines())}")
    assert get_passes().made_of and len(get_passes().strikes.splitlines()) == 4, get_passes().messages
    for line in get_passes().strikes.splitlines():
        output.write_line(f"     {line}")
    scene, names = window.window.scene, [row.body.name for row in get_passes().players]
    assert len(set(names)) == 3
    frame = int(get_passes().strikes.splitlines()[1].partition("\t")[0])
    scene.frame_set(frame)
    view = window.find_area("VIEW_3D").spaces.active.region_3d
    view.view_perspective, view.view_distance, view.view_location = "PERSP", 12.0, (0.0, 0.0, 0.8)
    yield 1.0
    window.save_picture(PICTURES / "ball_scene.png")
    back()
    assert_no_errors_since(mark)


def check_a_dragged_position_updates_the_scene():
    mark = len(output.text())
    BEFORE.update(ball=list_positions("Passing Ball"), made=get_passes().made_of,
                  place=tuple(find_object("Ann place").location))
    select_objects("Ann place")
    bpy.ops.ed.undo_push(message="before the drag")
    area = window.find_area("VIEW_3D")
    yield from window.move_pointer(area.x + 500, area.y + 400)
    yield from window.press_key("G")
    for step in range(12):
        yield from window.move_pointer(area.x + 500 + 6 * step, area.y + 400 + 4 * step)
    yield from window.press_key("LEFTMOUSE")
    start = time.monotonic()
    yield from wait_until(lambda: get_passes().made_of != BEFORE["made"])
    yield from wait_until_settled()  # a slow machine may have taken a halt on the way for the end
    output.write_line(f"     made anew {time.monotonic() - start:.1f} s after the hand rests")
    yield 0.5
    window.save_picture(PICTURES / "ball_dragged.png")
    now = list_positions("Passing Ball")
    assert now.shape != BEFORE["ball"].shape or np.abs(now - BEFORE["ball"]).max() > 0.05, "the ball goes the same way"
    frame = int(get_passes().strikes.splitlines()[0].partition("\t")[0])
    window.window.scene.frame_set(frame)
    yield 0.3
    place = np.array(find_object("Ann place").matrix_world.translation)[:2]
    hips = find_object(get_passes().players["Ann"].body.name)
    hips = np.array((hips.matrix_world @ hips.pose.bones[0].matrix).translation)[:2]
    assert np.linalg.norm(place - hips) < 0.8, (place, hips)
    yield from window.press_key("Z", ctrl=True)
    yield from wait_until_settled()
    assert get_passes().made_of == BEFORE["made"] and np.array_equal(
        list_positions("Passing Ball"), BEFORE["ball"]
    ), "undo is another scene"
    yield from window.press_key("Z", ctrl=True)
    yield from wait_until_settled()
    assert np.allclose(
        find_object("Ann place").location, BEFORE["place"], atol=1e-6
    ), "the second undo does not take the drag back"
    assert get_passes().made_of == BEFORE["made"]
    assert_no_errors_since(mark)


def check_bounces_change_and_invalid_values_are_reported():
    mark, before = len(output.text()), get_passes().made_of
    get_passes().passes[0].bounces = 0
    yield from wait_until(lambda: get_passes().made_of != before)
    yield from wait_until_settled()
    before = get_passes().made_of
    get_passes().passes[0].to = get_passes().passes[0].who
    yield from wait_until(lambda: "both passer and receiver" in get_passes().messages)
    yield from wait_until_settled()
    assert get_passes().made_of == before
    get_passes().passes[0].to = "Ben"
    yield 1.0
    yield from wait_until_settled()
    assert get_passes().made_of == before
    assert_no_errors_since(mark)


def check_a_hand_carries_the_ball():
    mark = len(output.text())
    body = get_passes().players["Cho"].body.name
    last = int(get_passes().strikes.splitlines()[-1].partition("\t")[0])
    select_objects("Passing Ball", body)
    get_passes().hold_first, get_passes().hold_last = last + 8, last + 38
    back = yield from isolate_panel("draw_carried_ball")
    yield from click_operator("take_ball")
    yield from wait_until(lambda: len(find_object("Passing Ball").constraints) == 1)
    ball = find_object("Passing Ball")
    assert len(ball.beyond_mocap_ball.holds) == 1
    at = []
    for frame in range(last + 4, last + 42):
        window.window.scene.frame_set(frame)
        at.append(np.array(ball.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.translation))
    steps = np.linalg.norm(np.diff(at, axis=0), axis=1)
    output.write_line(f"     carried: the ball moves {steps.max():.2f} m between two frames at most")
    assert steps.max() < 0.9, steps
    yield 0.3
    window.save_picture(PICTURES / "ball_carried.png")
    yield from click_operator("free_ball")
    yield from wait_until(lambda: not len(find_object("Passing Ball").constraints))
    back()
    assert_no_errors_since(mark)
