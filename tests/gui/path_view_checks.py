"""What is drawn of riders costs next to nothing and is made anew only when a motion was; so does the panel about
them."""

import time

import bpy
from tab import (
    PICTURES,
    TAB,
    copy_sample,
    import_module,
    open_task,
    output,
    report_time,
    run_operator,
    wait_until,
    wait_until_settled,
    window,
)
from window import ObjectProxy, draw_unfolded

SWITCHES = ("path_source", "path_new", "path_trackers", "path_residuals", "path_ghost")


def create_path_edit():
    """A walk of the sample on a curve, which is active, all overlays of paths on."""
    bpy.ops.wm.read_homefile(use_empty=True, load_ui=False)
    yield 1
    bpy.ops.beyond_mocap.import_clips(filepath=str(copy_sample() / "library" / "walk_jog_walk.bvh"))
    bpy.ops.beyond_mocap.edit_path(kind="NURBS", count=8)
    for name in SWITCHES:
        setattr(bpy.context.scene.beyond_mocap.view, name, True)
    yield 0.5
    yield from wait_until_settled()


def redraw_view(count):
    for _ in range(count):
        window.find_area("VIEW_3D").tag_redraw()
        yield 0.06


class DrawCounter:
    """While a `with` lasts: what each call of the drawing of riders takes, and which shapes are made."""

    def __enter__(self):
        self.draw, self.rides = import_module("scene.overlays.draw"), import_module("scene.overlays.path_overlays")
        self.seconds, self.made = [], []
        self.items, self.making = self.rides.list_items, self.draw._build_batches
        self.draw.path_overlays = ObjectProxy(self.rides, list_items=self.timed)
        self.draw._build_batches = self.watched
        return self

    def timed(self, scene):
        start = time.perf_counter()
        found = self.items(scene)
        self.seconds.append(time.perf_counter() - start)
        return found

    def watched(self, key, meshes):
        new, start = key not in self.draw._batches, time.perf_counter()
        found = self.making(key, meshes)
        if new:
            self.made.append((key, time.perf_counter() - start))
        return found

    def __exit__(self, *error):
        self.draw.path_overlays, self.draw._build_batches = self.rides, self.making

    def report_times(self, heading):
        each = 1000 * sorted(self.seconds)[len(self.seconds) // 2]
        making = 1000 * sum(seconds for _, seconds in self.made)
        output.write_line(f"     {heading}: {each:.2f} ms a redraw, {len(self.made)} shapes made in {making:.1f} ms")
        return each


def check_overlays_are_built_once():
    yield from create_path_edit()
    yield from redraw_view(4)
    with DrawCounter() as counted:
        yield from redraw_view(12)
    report_time("at rest, ms", counted.report_times("at rest"), 0.5)
    assert len(counted.seconds) >= 10 and not counted.made
    with DrawCounter() as counted:
        bpy.context.object.data.splines[0].points[4].co.y += 1.0
        run_operator("beyond_mocap.update_path", "EXEC_DEFAULT")
        yield from redraw_view(6)
    counted.report_times("laid anew once")
    source = import_module("scene.path_editing.edited_bodies").find_computed_edit(find_edited_body()).source
    assert 0 < len(counted.made) <= 3, [key[1:] for key, _ in counted.made]
    assert all(key[0] is not source for key, _ in counted.made), "the original's own shapes were made again"
    report_time("shapes made anew, s", sum(seconds for _, seconds in counted.made), 0.02)
    with DrawCounter() as counted:
        for name in SWITCHES:
            setattr(bpy.context.scene.beyond_mocap.view, name, False)
        yield from redraw_view(8)
    report_time("switched off, ms", counted.report_times("switched off"), 0.1)
    assert not counted.made
    batches = import_module("scene.overlays.draw")._batches
    assert not [key for key in batches if not isinstance(key[0], str)], "shapes of riders are kept though none is drawn"


def find_edited_body():
    return next(thing for thing in bpy.context.scene.objects if thing.type == "ARMATURE")


def check_overlays_are_removed_with_their_bodies():
    yield from create_path_edit()
    yield from redraw_view(3)
    draw = import_module("scene.overlays.draw")
    assert [key for key in draw._batches if not isinstance(key[0], str)]
    run_operator("beyond_mocap.leave_path", "EXEC_DEFAULT")
    yield from redraw_view(4)
    assert not [key for key in draw._batches if not isinstance(key[0], str)]
    yield from create_path_edit()
    yield from redraw_view(3)
    bpy.data.objects.remove(find_edited_body())
    yield from redraw_view(3)
    assert not [key for key in draw._batches if not isinstance(key[0], str)]
    bpy.ops.wm.read_homefile(use_empty=True)
    yield from redraw_view(3)


def check_the_panel_is_quick():
    yield from create_path_edit()
    area, panel, spent = window.find_area("VIEW_3D"), import_module("panels.path_editing").BEYOND_MOCAP_PT_path, []
    fold, plain = draw_unfolded(panel), panel.draw

    def timed(self, context):
        start = time.perf_counter()
        plain(self, context)
        spent.append(time.perf_counter() - start)

    panel.draw = timed
    opened = type("BEYOND_MOCAP_PT_path_opened", panel.__bases__, {
        **{key: value for key, value in vars(panel).items() if not key.startswith("__") and key != "bl_rna"},
        "bl_options": set(), "bl_order": 0, "draw": timed})
    bpy.utils.register_class(opened)
    yield from window.open_tab(area, TAB)
    yield from open_task("PATH")
    for _ in range(20):
        window.find_sidebar(area).tag_redraw()
        yield 0.06
    window.save_picture(PICTURES / "path-panel.png")
    bpy.utils.unregister_class(opened)
    panel.draw = plain
    fold()
    each = 1000 * sorted(spent)[len(spent) // 2]
    assert len(spent) >= 10
    report_time("the panel, unfolded, ms", each, 2.5)


def check_figures_come_when_the_curve_is_at_rest():
    yield from create_path_edit()
    yield from wait_until(lambda: "skate" in find_edited_body().beyond_mocap_ride.figures)
    told = import_module("panels.path_editing").describe_figures(find_edited_body().beyond_mocap_ride.figures)
    output.write_line("     " + "; ".join(line.replace("\t", " ") for line in told.splitlines()))
    assert "Foot slide" in told and "Distance to path" in told


def check_keys_flick_through_the_cameras_and_back():
    yield from create_path_edit()
    run_operator("beyond_mocap.path_cameras", "EXEC_DEFAULT")
    area, scene = window.find_area("VIEW_3D"), bpy.context.scene
    own = bpy.data.objects.new("Own", bpy.data.cameras.new("Own"))
    scene.collection.objects.link(own)
    scene.camera = own
    view, kinds = area.spaces.active.region_3d, import_module("scene.stage.path_cameras").KINDS
    yield from window.move_pointer(area.x + area.width // 3, area.y + area.height // 2)
    for perspective in ("PERSP", "ORTHO", "CAMERA"):
        view.view_perspective = perspective
        yield 0.5
        before, seen = [list(row) for row in view.view_matrix], []
        for key in ("J", "NUMPAD_0", "J", "NUMPAD_0"):
            yield from window.press_key(key, shift=True)
            yield 0.3  # the view glides
            assert view.view_perspective == "CAMERA"
            seen.append(scene.camera.get("beyond_mocap_path_camera"))
        assert seen == list(kinds), seen
        yield from window.press_key("J", shift=True)

        def apart():
            return max(abs(a - b) for row, old in zip(view.view_matrix, before) for a, b in zip(row, old))

        yield from wait_until(lambda: scene.camera == own and view.view_perspective == perspective, 60.0)
        yield from wait_until(
            lambda: apart() < 1e-4, 60.0, lambda: f"{perspective}: the view came back elsewhere, by {apart()}"
        )


def check_keys_nudge_and_the_body_follows():
    yield from create_path_edit()
    area = window.find_area("VIEW_3D")
    with bpy.context.temp_override(window=window.window):
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.curve.select_all(action="DESELECT")
        bpy.context.object.data.splines[0].points[4].select = True
        bpy.ops.ed.undo_push(message="selected")
    yield from window.move_pointer(area.x + area.width // 3, area.y + area.height // 2)
    yield 0.5
    riders, frame = import_module("scene.path_editing.edited_bodies"), bpy.context.scene.frame_current
    start, laid = tuple(bpy.context.object.data.splines[0].points[4].co), riders.find_computed_edit(
        find_edited_body()).number
    for count, key in enumerate(("UP_ARROW", "UP_ARROW", "RIGHT_ARROW", "PAGE_UP"), 1):
        yield from window.press_key(key, alt=True)
        yield from wait_until(lambda: riders.find_computed_edit(find_edited_body()).number - laid >= count, 60.0)
        yield from wait_until_settled()
    moved = [round(a - b, 4) for a, b in zip(bpy.context.object.data.splines[0].points[4].co, start)]
    assert moved[:3] == [0.1, 0.2, 0.1] and bpy.context.scene.frame_current == frame, moved
    assert riders.find_computed_edit(find_edited_body()).number - laid == 4
    for _ in range(4):
        yield from window.press_key("Z", ctrl=True)
        yield from wait_until_settled()
    back = [round(a - b, 4) for a, b in zip(bpy.context.object.data.splines[0].points[4].co, start)]
    assert back[:3] == [0.0, 0.0, 0.0] and bpy.context.mode == "EDIT_CURVE", (back, bpy.context.mode)
