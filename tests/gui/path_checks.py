"""Path editing in the window: a control point dragged while a walk of 600 frames follows, and what goes with it."""

import statistics
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
    report_time,
    run_operator,
    wait_until,
    window,
)

FRAMES = 600
BUDGET = 66.0
"""Milliseconds of work that an update may take: fifteen a second."""
FLOOR, FREE = 8.0, 14.0
"""Updates a second of wall clock, drawing by software included, where this machine draws FREE a second without them."""
BEFORE = {}  # curve and body before the hand moved them


def write_long_walk():
    """The sample's walk repeated on a straight line until it has 600 frames, as a BVH file."""
    bvh = import_module("beyond_mocap.files.bvh.bvh")
    modules = ("path_edit", "path_edit_settings", "path_edit_source", "path_line")
    edit, edit_settings, edit_source, line = (import_module(f"beyond_mocap.path_editing.{name}") for name in modules)
    clip = bvh.read_bvh(copy_sample() / "library" / "walking_1_2.bvh", 0.01)
    wishes = edit_settings.PathEditSettings(cycle=True, plant=False, lean=False)
    straight = line.fit_line(np.array([[0.0, 0, 0], [40.0, 0, 0]]), "line")
    ridden = edit.edit_path(edit_source.prepare_source(clip.motion, wishes), straight, wishes)
    rate = round(clip.motion.fps / 30.0)
    motion = ridden.motion
    assert len(motion) >= FRAMES * rate, f"only {len(motion)} frames at {motion.fps} per second"
    path = (PICTURES / "long_walk.bvh").resolve()
    bvh.write_bvh(path, motion.frames(0, FRAMES * rate))
    return path


def find_body(name="long_walk"):
    """The walker; looked up each time, since undo replaces it."""
    return bpy.data.objects[name]


def find_curve(name="long_walk"):
    """The curve that it rides."""
    return find_body(name).beyond_mocap_ride.curve


def list_points(name="long_walk"):
    """The curve's control points."""
    return find_curve(name).data.splines[0].bezier_points


def collect_keys(name="long_walk"):
    """All that the armature plays, bit by bit."""
    action = find_body(name).animation_data.action
    found = {}
    for curve in action.layers[0].strips[0].channelbag(find_body(name).animation_data.action_slot).fcurves:
        values = np.empty(2 * len(curve.keyframe_points), np.float32)
        curve.keyframe_points.foreach_get("co", values)
        found[curve.data_path, curve.array_index] = values.tobytes()
    return found


def collect_shape(name="long_walk"):
    """The curve's points and handles, bit by bit."""
    return [(*point.co, *point.handle_left, *point.handle_right) for point in list_points(name)]


def measure_pelvis(name="long_walk"):
    """Where the body is drawn, in the world, seen from above."""
    shown = find_body(name).evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array(shown.matrix_world @ shown.pose.bones[0].head)[:2]


def sample_curve(name="long_walk"):
    """The curve as Blender draws it, seen from above."""
    shown = find_curve(name).evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = shown.to_mesh()
    places = np.array([shown.matrix_world @ vertex.co for vertex in mesh.vertices])[:, :2]
    shown.to_mesh_clear()
    fine = np.concatenate([np.linspace(a, b, 20) for a, b in zip(places, places[1:])])
    return fine


def measure_distance(name="long_walk"):
    """Metres from the body to the curve, as both are drawn."""
    return np.linalg.norm(sample_curve(name) - measure_pelvis(name), axis=1).min()


class UpdateCounter:
    """Counts what the riders' module works out, and how long it takes: live's own calls, unchanged."""

    def __enter__(self):
        self.riders, self.spent, self.cpu = import_module("scene.path_editing.edited_bodies"), [], []
        self.renew = self.riders.update_motion

        def count_call(*arguments, **named):
            start, worked = time.perf_counter(), time.thread_time()
            done = self.renew(*arguments, **named)
            if done:
                self.cpu.append(1000.0 * (time.thread_time() - worked))
                self.spent.append(1000.0 * (time.perf_counter() - start))
            return done

        self.riders.update_motion = count_call
        return self

    def __exit__(self, *_):
        self.riders.update_motion = self.renew


def look_down(place, distance=14.0):
    """The view from above."""
    view = window.find_area("VIEW_3D").spaces.active.region_3d
    view.view_perspective, view.view_rotation, view.view_distance = "ORTHO", (1, 0, 0, 0), distance
    view.view_location = (*place, 0.0)


def to_region(place):
    """Where a place of the world is in the window."""
    from bpy_extras.view3d_utils import location_3d_to_region_2d

    area = window.find_area("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    found = location_3d_to_region_2d(region, area.spaces.active.region_3d, place)
    return region.x + found.x, region.y + found.y


def check_edit_path_is_a_button_and_tab_edits_the_curve():
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 1.0
    bpy.context.scene.render.fps = 30
    path = write_long_walk()
    assert run_operator("beyond_mocap.import_clips", "EXEC_DEFAULT", filepath=str(path)) == {"FINISHED"}
    yield 0.5
    walk = bpy.context.object
    walk.name = "long_walk"
    first, last = walk.animation_data.action.frame_range
    assert last - first + 1 == FRAMES, (first, last)
    area = window.find_area("VIEW_3D")
    back = yield from isolate_panel(area)
    yield from click_operator("edit_path")
    yield from wait_until(
        lambda: find_body().beyond_mocap_ride.on and bpy.context.object == find_curve(), 60.0,
        "Edit Path does something"
    )
    yield from wait_until_settled()
    back()
    look_down(np.array(find_curve().matrix_world @ list_points()[len(list_points()) // 2].co)[:2])
    yield from window.move_pointer(area.x + area.width // 3, area.y + area.height // 2)
    yield from window.press_key("TAB")
    yield from wait_until(lambda: bpy.context.mode == "EDIT_CURVE", 60.0)


def isolate_panel(area):
    """The panel Path Editing alone in a tab of its own, so that its button is found quickly; returns what puts it
    back."""
    kind = next(panel for panel in bpy.types.Panel.__subclasses__() if panel.__name__ == "BEYOND_MOCAP_PT_path")
    was = kind.bl_category, getattr(kind, "bl_options", set())

    def place_panel(category, options):
        bpy.utils.unregister_class(kind)
        kind.bl_category, kind.bl_options = category, options
        bpy.utils.register_class(kind)

    yield from open_task("PATH")
    place_panel("Path Check", set())
    yield from window.open_tab(area, "Path Check")
    return lambda: place_panel(*was)


def grab_point(number, start=0.0):
    """One control point selected, the playhead where the body is near it, and G pressed with the pointer over the
    view."""
    for other, point in enumerate(list_points()):
        point.select_control_point = point.select_left_handle = point.select_right_handle = other == number
    place = np.array(find_curve().matrix_world @ list_points()[number].co)
    scene = window.window.scene
    shown = import_module("scene.path_editing.edited_bodies").find_computed_edit(find_body())
    scene.frame_set(shown.first + int(np.argmin(np.linalg.norm(shown.edited.origin[:, :2] - place[:2], axis=1))))
    bpy.ops.ed.undo_push(message="before the drag")
    yield 0.5
    yield from window.move_pointer(*to_region(place))
    yield from window.press_key("G")


def drag_pointer(seconds=6.0):
    """Move the hand for so long; how many moves there were, and how many seconds of wall clock and of work they
    took."""
    moves, begun, worked = 0, time.perf_counter(), time.thread_time()
    while time.perf_counter() - begun < seconds or moves < 5:
        x, y = window.pointer
        yield from window.move_pointer(x + 4 * np.cos(moves / 2), y + 3 * np.sin(moves / 3) + 1)
        moves += 1
    return moves, time.perf_counter() - begun, time.thread_time() - worked


def wait_until_settled():
    """Wait until live has seen everything, also while a point is held."""
    live, quiet = import_module("scene.path_editing.live"), 0
    start = time.monotonic()
    while quiet < 4:
        assert time.monotonic() - start < 300.0, "live does not come to rest"
        yield 0.05
        quiet = 0 if live.WATCHER.dirty else quiet + 1


def move_over_view():
    """The pointer in the 3D view."""
    area = window.find_area("VIEW_3D")
    yield from window.move_pointer(area.x + area.width // 3, area.y + area.height // 2)


def check_the_body_follows_a_dragged_point():
    mark = len(output.text())
    number = len(list_points()) // 2
    find_body().beyond_mocap_ride.live = False
    yield from grab_point(number)
    moves, wall, _ = yield from drag_pointer()
    free = moves / wall
    yield from window.press_key("ESC")
    find_body().beyond_mocap_ride.live = True
    yield from wait_until_settled()
    BEFORE.update(keys=collect_keys(), shape=collect_shape())
    yield from grab_point(number)
    before, off = measure_pelvis(), []
    with UpdateCounter() as updates:
        moves, wall, worked = yield from drag_pointer()
        yield from wait_until_settled()
    count, spent = len(updates.cpu), sorted(updates.cpu)
    for _ in range(6):
        x, y = window.pointer
        yield from window.move_pointer(x + 6, y + 14)
        yield from wait_until_settled()
        off.append(measure_distance())
    window.save_picture(PICTURES / "path_drag.png")
    output.write_line(f"     {FRAMES} frames: one update takes {statistics.median(spent):.0f} ms of work (95 % within "
                      f"{spent[int(0.95 * (count - 1))]:.0f}), {statistics.median(updates.spent):.0f} ms of wall clock")
    output.write_line(f"     {count} updates in {moves} moves, {count / wall:.1f} a second of wall clock, "
                      f"{count / worked:.1f} a second "
                      f"of the main thread's work; without following this machine draws {free:.1f} moves a second")
    output.write_line(
        f"     the body is {max(off):.3f} m off the curve at most; "
        f"it went {np.linalg.norm(measure_pelvis() - before):.2f} m"
    )
    assert np.linalg.norm(measure_pelvis() - before) > 0.2, "the body stayed where it was"
    assert max(off) < 0.15, off
    assert count > 0
    report_time("one update, ms", statistics.median(spent), BUDGET)
    if count < 0.7 * moves:
        report_time("seconds an update, where moves are skipped", wall / count, 1.0 / 15.0)
    if free >= FREE:
        report_time("seconds an update, wall clock", wall / count, 1.0 / FLOOR)
    yield from window.press_key("LEFTMOUSE")
    yield from wait_until_settled()
    assert_no_errors_since(mark)


def check_ctrl_z_brings_back_curve_and_body_to_the_bit():
    mark = len(output.text())
    yield from wait_until_settled()
    after, moved = collect_keys(), collect_shape()
    yield from move_over_view()
    yield from window.press_key("Z", ctrl=True)
    yield 0.5
    yield from wait_until_settled()
    back, undone = collect_keys(), collect_shape()
    assert undone == BEFORE["shape"] != moved, "undo did not bring back the curve"
    assert back == BEFORE["keys"] != after, "undo did not bring back the body"
    assert measure_distance() < 0.15
    yield from window.press_key("Z", ctrl=True, shift=True)
    yield 0.5
    yield from wait_until_settled()
    assert collect_shape() == moved, "redo is another curve"
    assert collect_keys() == after, "redo is another body"
    yield from window.press_key("Z", ctrl=True)
    yield 0.5
    yield from wait_until_settled()
    assert collect_shape() == undone and collect_keys() == back, "the second undo is not the first"
    assert_no_errors_since(mark)


def check_escape_while_dragging_leaves_nothing():
    yield from wait_until_settled()
    before, was = collect_keys(), collect_shape()
    yield from grab_point(1)
    yield from wait_until_settled()
    for _ in range(5):
        yield from window.move_pointer(window.pointer[0], window.pointer[1] + 16)
    yield from wait_until_settled()
    assert collect_keys() != before, "the body did not follow"
    yield from window.press_key("ESC")
    yield from wait_until_settled()
    assert collect_shape() == was, "the curve is another"
    assert collect_keys() == before, "the body is another"


def check_nudges_move_the_point_by_the_step():
    mark = len(output.text())
    get_settings().nudge_step = 0.25
    place, before = tuple(list_points()[1].co), collect_keys()
    yield from move_over_view()
    yield from window.press_key("UP_ARROW", alt=True)
    yield from wait_until_settled()
    went = np.array(list_points()[1].co) - place
    assert np.allclose(went, (0.0, 0.25, 0.0), atol=1e-5), went
    assert collect_keys() != before, "the body did not follow"
    yield from window.press_key("Z", ctrl=True)
    yield from wait_until_settled()
    assert np.allclose(list_points()[1].co, place) and collect_keys() == before
    assert_no_errors_since(mark)


def check_cameras_are_flicked_through_by_a_key():
    mark = len(output.text())
    area = window.find_area("VIEW_3D")
    if bpy.context.mode != "OBJECT":
        yield from move_over_view()
        yield from window.press_key("TAB")
        yield 0.5
    assert run_operator("beyond_mocap.path_cameras") == {"FINISHED"}
    yield 0.5
    seen = []
    yield from move_over_view()
    for number in range(5):
        yield from window.press_key("J", shift=True)
        yield 1.0
        view = area.spaces.active.region_3d.view_perspective
        seen.append(bpy.context.scene.camera.name if view == "CAMERA" else view)
        window.save_picture(PICTURES / f"path_camera_{number}.png")
    output.write_line(f"     {seen}")
    assert len(set(seen[:4])) == 4 and seen[4] in {"ORTHO", "PERSP"}, seen
    assert_no_errors_since(mark)


def check_overlays_are_drawn():
    mark = len(output.text())
    view = get_settings().view
    for name in ("path_source", "path_new", "path_trackers", "path_residuals", "path_ghost"):
        setattr(view, name, True)
    bend = list_points()[len(list_points()) // 2]
    for name in ("co", "handle_left", "handle_right"):
        getattr(bend, name).y += 1.5
    yield from wait_until_settled()
    region = window.find_area("VIEW_3D").spaces.active.region_3d
    region.view_rotation, region.view_distance = (0.82, 0.4, 0.17, 0.36), 7.0
    region.view_location = (*measure_pelvis(), 0.5)
    yield 1.0
    window.save_picture(PICTURES / "path_overlays.png")
    assert_no_errors_since(mark)


def check_two_riders_keep_apart_and_both_follow():
    mark = len(output.text())
    bpy.context.view_layer.objects.active = None
    run_operator("beyond_mocap.import_clips", "EXEC_DEFAULT", filepath=str((PICTURES / "long_walk.bvh").resolve()))
    yield 0.5
    bpy.context.object.name = "second"
    assert run_operator("beyond_mocap.edit_path", "EXEC_DEFAULT") == {"FINISHED"}
    yield 0.5
    assert run_operator("beyond_mocap.path_apart", "EXEC_DEFAULT") == {"FINISHED"}
    yield from wait_until_settled()
    asked = [find_body(name).beyond_mocap_ride.detours for name in ("long_walk", "second")]
    assert any(len(text) > 2 for text in asked), asked
    gaps = []
    for frame in range(1, FRAMES, 60):
        window.window.scene.frame_set(frame)
        gaps.append(np.linalg.norm(measure_pelvis("long_walk") - measure_pelvis("second")))
    output.write_line(f"     two walkers on one path keep {min(gaps):.2f} m apart")
    assert min(gaps) > 0.55, gaps
    with UpdateCounter() as updates:
        for name in ("long_walk", "second"):
            list_points(name)[2].co.y += 0.2
        window.window.view_layer.update()
        yield from wait_until(lambda: len(updates.spent) >= 2)
    window.save_picture(PICTURES / "path_two.png")
    assert_no_errors_since(mark)


def check_bake_and_leave():
    mark = len(output.text())
    for name in ("second", "long_walk"):
        for thing in bpy.context.view_layer.objects:
            thing.select_set(thing == find_body(name))
        bpy.context.view_layer.objects.active = find_body(name)
        played = collect_keys(name)
        assert run_operator("beyond_mocap.bake_path" if name == "second" else "beyond_mocap.leave_path",
                            "EXEC_DEFAULT") == {
            "FINISHED"
        }
        yield 0.5
        assert not find_body(name).beyond_mocap_ride.on
        assert (collect_keys(name) == played) == (name == "second")
    assert_no_errors_since(mark)
