"""What is drawn over the 3D view: every overlay, cheap to draw, and nothing left behind or broken by undo, delete,
load."""

import time

import bpy
from mathutils import Euler, Quaternion
from tab import PICTURES, TAB, copy_sample, get_settings, import_module, output, report_time, wait_until, window
from window import ObjectProxy

OVERLAYS = ("track", "footprints", "contacts", "seams", "moments", "speed", "heading", "ghosts")


def switch_overlays(*names):
    """Switch on these overlays and no other."""
    for name in OVERLAYS:
        setattr(get_settings().view, name, name in names)


def wait_until_prepared():
    """Wait until every player that is shown is prepared."""
    store = import_module("scene.overlays.store")
    yield from wait_until(
        lambda: all(store.find_prepared(player.take) for player in store.list_shown_players(get_settings())),
        what="prepared"
    )


def open_synthesized(seconds=8.0):
    """The sample with the takes of both players shown, made once for all checks, the playhead near a kick."""
    session = import_module("scene.core.session")
    if not get_settings().players or session.find_take(get_settings().players[0].take) is None:
        bpy.ops.wm.open_mainfile(filepath=str(copy_sample() / "quickstart.blend"))
        yield 1.0
        with bpy.context.temp_override(window=window.window):
            assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    get_settings().view.players = "ACTIVE"
    bpy.context.scene.frame_set(round(1 + seconds * bpy.context.scene.render.fps))
    yield 0.3


def set_view(kind):
    """Turn the view to the active player, from "above" or from the "side"."""
    view = window.find_area("VIEW_3D").spaces.active.region_3d
    body = get_settings().players[get_settings().active_player].body
    place = body.matrix_world @ body.pose.bones[0].head
    view.view_perspective, view.view_location = "PERSP", (place.x, place.y, 0.6)
    turn, view.view_distance = {"above": (Quaternion(), 9.0), "side": (Euler((1.3, 0, 0.5)).to_quaternion(), 6.5)}[kind]
    view.view_rotation = turn


def redraw_view(count):
    """Draw the 3D view `count` times."""
    for _ in range(count):
        window.find_area("VIEW_3D").tag_redraw()
        yield 0.12


DRAWN = (("_draw_shapes", "POST_VIEW"), ("_draw_texts", "POST_PIXEL"))


class DrawTimer:
    """Counts how long the two handlers take, and how many batches they draw, while a `with` lasts."""

    def __init__(self):
        self.draw, self.seconds, self.drawn = import_module("scene.overlays.draw"), [], 0
        self.window = import_module("scene.core.window")

    def __enter__(self):
        names = ("_draw_shapes", "_draw_texts", "_draw_batches", "_draw_contacts")
        self.kept, self.blf = {name: getattr(self.draw, name) for name in names}, None
        self.draw.clear_batches()
        for name, when in DRAWN:
            self.window.remove_overlay(self.kept[name])
            setattr(self.draw, name, self.time_function(self.kept[name]))
            self.window.add_overlay(bpy.types.SpaceView3D, getattr(self.draw, name), when)
        self.draw._draw_batches = self.count_batches
        return self

    def time_function(self, function):
        def run_timed():
            start = time.perf_counter()
            function()
            self.seconds.append((function.__name__, time.perf_counter() - start))
        return run_timed

    def count_batches(self, context, batches):
        self.drawn += len(batches)
        self.kept["_draw_batches"](context, batches)

    def __exit__(self, *error):
        self.draw.clear_batches()
        for name, when in DRAWN:
            self.window.remove_overlay(getattr(self.draw, name))
            self.window.add_overlay(bpy.types.SpaceView3D, self.kept[name], when)
        if self.blf is not None:
            self.draw.blf, self.draw.draw_box = self.blf, self.box
        for name, function in self.kept.items():
            setattr(self.draw, name, function)

    def disable_graphics(self):
        """From here on all is done but the drawing itself: what remains is Python's time. llvmpipe's says nothing."""
        self.blf, self.box = self.draw.blf, self.draw.draw_box
        self.draw.blf, self.draw.draw_box = ObjectProxy(self.blf, draw=lambda *_: None), lambda *_: None
        self.count_batches, self.seconds = None, []
        self.draw._draw_batches = lambda context, batches: [mesh for _, mesh in batches]
        self.draw._draw_contacts = lambda shown: shown.prepared.find_frame(shown.seconds)

    def compute_median(self):
        """Median milliseconds of both handlers together."""
        shapes, texts = ([s for name, s in self.seconds if name == which] for which in ("_draw_shapes", "_draw_texts"))
        return 1000.0 * (sorted(shapes)[len(shapes) // 2] + sorted(texts)[len(texts) // 2])


def check_every_overlay_is_drawn():
    yield from open_synthesized()
    switch_overlays("track")
    yield from wait_until_prepared()
    for kind in ("side", "above"):
        set_view(kind)
        for name in OVERLAYS:
            switch_overlays(name)
            yield 0.5
            window.save_picture(PICTURES / f"view-{name}-{kind}.png")
        switch_overlays(*OVERLAYS)
        yield 0.5
        window.save_picture(PICTURES / f"view-{kind}.png")


def check_drawing_is_cheap():
    yield from open_synthesized()
    set_view("side")
    switch_overlays(*OVERLAYS)
    yield from wait_until_prepared()
    yield from redraw_view(3)
    for whose, most in (("ACTIVE", 3.0), ("TICKED", 6.0)):
        get_settings().view.players = whose
        yield from wait_until_prepared()
        yield from redraw_view(3)
        with DrawTimer() as clock:
            yield from redraw_view(12)
            count = len([1 for name, _ in clock.seconds if name == "_draw_shapes"])
            told = f"{clock.drawn / max(count, 1):.0f} batches, {clock.compute_median():.1f} ms on this renderer"
            clock.disable_graphics()
            yield from redraw_view(12)
            report_time(f"{whose}: {told}; of it Python, ms", clock.compute_median(), most)
    switch_overlays()
    yield from redraw_view(3)
    with DrawTimer() as clock:
        yield from redraw_view(10)
    assert clock.drawn == 0
    report_time("switched off, ms", clock.compute_median(), 0.2)


def check_the_panels_are_quick_with_22_players():
    yield from open_synthesized()
    yield from wait_until_prepared()
    one = get_settings().players[0]
    for number in range(20):
        more = get_settings().players.add()
        more.name, more.take, more.body = f"player {number + 3}", one.take, one.body
        more.quality, more.moments, more.warnings = one.quality, one.moments, one.warnings
    area = window.find_area("VIEW_3D")
    yield from window.open_tab(area, TAB)
    spent = {}

    def clocked(cls, draw):
        def drawn(self, context):
            start = time.perf_counter()
            draw(self, context)
            spent.setdefault(cls.__name__, []).append(time.perf_counter() - start)
        return drawn

    opened = []
    for feature, name in (("result", "quality"), ("view", "view")):
        cls = getattr(import_module(f"panels.{feature}"), f"BEYOND_MOCAP_PT_{name}")
        own = {key: value for key, value in vars(cls).items() if not key.startswith("__") and key != "bl_rna"}
        own.update(bl_options=set(), bl_order=cls.bl_order - 10, draw=clocked(cls, cls.draw))
        opened.append(type(f"{cls.__name__}_opened", cls.__bases__, own))
        bpy.utils.register_class(opened[-1])
    for _ in range(10):
        for region in area.regions:
            region.tag_redraw()
        yield 0.15
    window.save_picture(PICTURES / "view-panels.png")
    for cls in opened:
        bpy.utils.unregister_class(cls)
    while len(get_settings().players) > 2:
        get_settings().players.remove(2)
    told = {name: 1000 * sorted(values)[len(values) // 2] for name, values in spent.items()}
    output.write_line("     " + ", ".join(f"{name.rpartition('_')[2]}: {value:.2f} ms" for name, value in told.items()))
    assert len(told) == 2, told
    report_time("both, ms", sum(told.values()), 5.0)


def check_a_warning_goes_to_its_frame():
    yield from open_synthesized()
    player = get_settings().players[0]
    player.warnings = "5.0-5.2, 7.0 s: planted\t5.000 7.000"
    area = window.find_area("VIEW_3D")
    body = player.body
    before = area.spaces.active.region_3d.view_location.copy()
    with bpy.context.temp_override(
        window=window.window, area=area, region=next(r for r in area.regions if r.type == "WINDOW")
    ):
        bpy.context.scene.frame_set(1)
        bpy.ops.beyond_mocap.jump_to("INVOKE_DEFAULT", stops="5.000 7.000", player=player.name, frame_view=True)
    yield from wait_until(
        lambda: (area.spaces.active.region_3d.view_location - before).length > 0.1, what="the view has moved"
    )
    assert bpy.context.scene.frame_current == 1 + 5 * bpy.context.scene.render.fps
    assert bpy.context.view_layer.objects.active == body
    assert bpy.context.window_manager.beyond_mocap_playhead.why or not import_module(
        "scene.overlays.store")._prepared


def check_error_curves_are_in_the_graph_editor():
    yield from open_synthesized()
    with bpy.context.temp_override(window=window.window):
        body = get_settings().players[0].body
        for thing in bpy.context.selected_objects:
            thing.select_set(False)
        body.select_set(True)
        bpy.context.view_layer.objects.active = body
        bpy.ops.beyond_mocap.error_curves()
    area = window.find_area("VIEW_3D")
    area.type = "GRAPH_EDITOR"
    yield 0.8
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window.window, area=area, region=region):
        area.spaces.active.dopesheet.filter_text = ""
        names = [curve.data_path for curve in bpy.context.visible_fcurves or ()]
        bpy.ops.graph.view_all()
    yield 0.8
    window.save_picture(PICTURES / "view-curves.png")
    area.type = "VIEW_3D"
    yield 0.5
    assert any("Root Error" in name for name in names), names[:20]


def check_overlays_of_removed_players_disappear():
    yield from open_synthesized()
    switch_overlays(*OVERLAYS)
    get_settings().view.players = "TICKED"
    yield from wait_until_prepared()
    yield from redraw_view(3)
    draw, store = import_module("scene.overlays.draw"), import_module("scene.overlays.store")
    yield from wait_until(lambda: draw._batches and store._prepared)
    with bpy.context.temp_override(window=window.window):
        bpy.ops.ed.undo_push(message="before")
        bpy.data.objects.remove(get_settings().players[0].body)
        yield from redraw_view(2)
        bpy.ops.ed.undo_push(message="removed")
        bpy.ops.ed.undo()
        yield from redraw_view(2)
        bpy.ops.beyond_mocap.discard()
        bpy.ops.ed.undo_push(message="discarded")
    yield 0.3
    yield from redraw_view(3)
    yield from wait_until(lambda: not store._prepared, 60.0, "takes that nobody shows are still prepared")
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 0.5
    yield from redraw_view(2)
    bpy.context.scene.beyond_mocap.view.track = True
    yield from redraw_view(2)
    yield from wait_until(lambda: not [key for key in draw._batches if key[0]], 60.0, "batches of takes that are gone")
