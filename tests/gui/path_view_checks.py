"""What is drawn of riders costs next to nothing and is made anew only when a motion was; so does the panel about
them."""

import time

import bpy
from tab import PICTURES, TAB, output, room, run, sample, settled, until, window, within
from window import Stand, unfold

SWITCHES = ("path_source", "path_new", "path_trackers", "path_residuals", "path_ghost")


def a_rider():
    """A walk of the sample on a curve, which is active, all overlays of paths on."""
    bpy.ops.wm.read_homefile(use_empty=True, load_ui=False)
    yield 1
    bpy.ops.beyond_mocap.import_clips(filepath=str(sample() / "library" / "walk_jog_walk.bvh"))
    bpy.ops.beyond_mocap.edit_path(kind="NURBS", count=8)
    for name in SWITCHES:
        setattr(bpy.context.scene.beyond_mocap.view, name, True)
    yield 0.5
    yield from settled()


def redrawn(count):
    for _ in range(count):
        window.area("VIEW_3D").tag_redraw()
        yield 0.06


class Counted:
    """While a `with` lasts: what each call of the drawing of riders takes, and which shapes are made."""

    def __enter__(self):
        self.draw, self.rides = room("scene.overlays.draw"), room("scene.overlays.rides")
        self.seconds, self.made = [], []
        self.items, self.making = self.rides.items, self.draw._made
        self.draw.rides = Stand(self.rides, items=self.timed)
        self.draw._made = self.watched
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
        self.draw.rides, self.draw._made = self.rides, self.making

    def told(self, heading):
        each = 1000 * sorted(self.seconds)[len(self.seconds) // 2]
        making = 1000 * sum(seconds for _, seconds in self.made)
        output.say(f"     {heading}: {each:.2f} ms a redraw, {len(self.made)} shapes made in {making:.1f} ms")
        return each


def check_overlays_of_riders_are_made_once():
    yield from a_rider()
    yield from redrawn(4)
    with Counted() as counted:
        yield from redrawn(12)
    within("at rest, ms", counted.told("at rest"), 0.5)
    assert len(counted.seconds) >= 10 and not counted.made
    with Counted() as counted:
        bpy.context.object.data.splines[0].points[4].co.y += 1.0
        run("beyond_mocap.update_path", "EXEC_DEFAULT")
        yield from redrawn(6)
    counted.told("laid anew once")
    source = room("scene.path_editing.riders").shown(rider()).source
    assert 0 < len(counted.made) <= 3, [key[1:] for key, _ in counted.made]
    assert all(key[0] is not source for key, _ in counted.made), "the original's own shapes were made again"
    within("shapes made anew, s", sum(seconds for _, seconds in counted.made), 0.02)
    with Counted() as counted:
        for name in SWITCHES:
            setattr(bpy.context.scene.beyond_mocap.view, name, False)
        yield from redrawn(8)
    within("switched off, ms", counted.told("switched off"), 0.1)
    assert not counted.made
    batches = room("scene.overlays.draw")._batches
    assert not [key for key in batches if not isinstance(key[0], str)], "shapes of riders are kept though none is drawn"


def rider():
    return next(thing for thing in bpy.context.scene.objects if thing.type == "ARMATURE")


def check_nothing_of_riders_stays_when_they_are_gone():
    yield from a_rider()
    yield from redrawn(3)
    draw = room("scene.overlays.draw")
    assert [key for key in draw._batches if not isinstance(key[0], str)]
    run("beyond_mocap.leave_path", "EXEC_DEFAULT")
    yield from redrawn(4)
    assert not [key for key in draw._batches if not isinstance(key[0], str)]
    yield from a_rider()
    yield from redrawn(3)
    bpy.data.objects.remove(rider())
    yield from redrawn(3)
    assert not [key for key in draw._batches if not isinstance(key[0], str)]
    bpy.ops.wm.read_homefile(use_empty=True)
    yield from redrawn(3)


def check_the_panel_is_quick():
    yield from a_rider()
    area, panel, spent = window.area("VIEW_3D"), room("panels.path_editing").BEYOND_MOCAP_PT_path, []
    fold, plain = unfold(panel), panel.draw

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
    for _ in range(20):
        window.sidebar(area).tag_redraw()
        yield 0.06
    window.picture(PICTURES / "path-panel.png")
    bpy.utils.unregister_class(opened)
    panel.draw = plain
    fold()
    each = 1000 * sorted(spent)[len(spent) // 2]
    assert len(spent) >= 10
    within("the panel, unfolded, ms", each, 2.5)


def check_figures_come_when_the_curve_is_at_rest():
    yield from a_rider()
    yield from until(lambda: "skate" in rider().beyond_mocap_ride.figures)
    told = room("panels.path_editing").figure_lines(rider().beyond_mocap_ride.figures)
    output.say("     " + "; ".join(line.replace("\t", " ") for line in told.splitlines()))
    assert "Foot slide" in told and "Distance to path" in told


def check_keys_flick_through_the_cameras_and_back():
    yield from a_rider()
    run("beyond_mocap.path_cameras", "EXEC_DEFAULT")
    area, scene = window.area("VIEW_3D"), bpy.context.scene
    own = bpy.data.objects.new("Own", bpy.data.cameras.new("Own"))
    scene.collection.objects.link(own)
    scene.camera = own
    view, kinds = area.spaces.active.region_3d, room("scene.stage.path_cameras").KINDS
    yield from window.move(area.x + area.width // 3, area.y + area.height // 2)
    for perspective in ("PERSP", "ORTHO", "CAMERA"):
        view.view_perspective = perspective
        yield 0.5
        before, seen = [list(row) for row in view.view_matrix], []
        for key in ("J", "NUMPAD_0", "J", "NUMPAD_0"):
            yield from window.press(key, shift=True)
            yield 0.3  # the view glides
            assert view.view_perspective == "CAMERA"
            seen.append(scene.camera.get("beyond_mocap_path_camera"))
        assert seen == list(kinds), seen
        yield from window.press("J", shift=True)

        def apart():
            return max(abs(a - b) for row, old in zip(view.view_matrix, before) for a, b in zip(row, old))

        yield from until(lambda: scene.camera == own and view.view_perspective == perspective, 60.0)
        yield from until(
            lambda: apart() < 1e-4, 60.0, lambda: f"{perspective}: the view came back elsewhere, by {apart()}"
        )


def check_keys_nudge_and_the_rider_follows():
    yield from a_rider()
    area = window.area("VIEW_3D")
    with bpy.context.temp_override(window=window.window):
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.curve.select_all(action="DESELECT")
        bpy.context.object.data.splines[0].points[4].select = True
        bpy.ops.ed.undo_push(message="selected")
    yield from window.move(area.x + area.width // 3, area.y + area.height // 2)
    yield 0.5
    riders, frame = room("scene.path_editing.riders"), bpy.context.scene.frame_current
    start, laid = tuple(bpy.context.object.data.splines[0].points[4].co), riders.shown(rider()).number
    for count, key in enumerate(("UP_ARROW", "UP_ARROW", "RIGHT_ARROW", "PAGE_UP"), 1):
        yield from window.press(key, alt=True)
        yield from until(lambda: riders.shown(rider()).number - laid >= count, 60.0)
        yield from settled()
    moved = [round(a - b, 4) for a, b in zip(bpy.context.object.data.splines[0].points[4].co, start)]
    assert moved[:3] == [0.1, 0.2, 0.1] and bpy.context.scene.frame_current == frame, moved
    assert riders.shown(rider()).number - laid == 4
    for _ in range(4):
        yield from window.press("Z", ctrl=True)
        yield from settled()
    back = [round(a - b, 4) for a, b in zip(bpy.context.object.data.splines[0].points[4].co, start)]
    assert back[:3] == [0.0, 0.0, 0.0] and bpy.context.mode == "EDIT_CURVE", (back, bpy.context.mode)
