"""The overlay of momentum in a real window: shown by its button, drawn for several characters, following edits, quick
while the animation plays, and gone with its switches.
"""

import time

import bpy
from mathutils import Euler
from tab import (
    PICTURES,
    TAB,
    click_operator,
    copy_sample,
    get_settings,
    import_module,
    report_time,
    run_operator,
    wait_until,
    window,
)

CLIPS = ("sprinting_6_0", "walking_1_2")


def import_characters():
    """Two clips beside each other, both selected, in a file of their own; their armatures."""
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 0.5
    bodies = []
    for number, clip in enumerate(CLIPS):
        run_operator("beyond_mocap.import_clips", "EXEC_DEFAULT",
                     filepath=str(copy_sample() / "library" / f"{clip}.bvh"))
        bodies.append(bpy.context.view_layer.objects.active)
        bodies[-1].location.y += 1.5 * number
    for body in bodies:
        body.select_set(True)
    bpy.context.scene.frame_set(31)
    yield 0.5
    return bodies


def unfold_view_panel():
    """Put an open copy of the panel "View" at the top of the tab; the closed one stays below."""
    cls = import_module("panels.view").BEYOND_MOCAP_PT_view
    own = {key: value for key, value in vars(cls).items() if not key.startswith("__") and key != "bl_rna"}
    own.update(bl_options=set(), bl_order=-10)
    bpy.utils.register_class(type(f"{cls.__name__}_opened", cls.__bases__, own))


def list_shown():
    """The traces that are drawn now, and their rows."""
    return import_module("scene.overlays.momentum").list_current_rows(bpy.context.scene)


def look_at(body, distance=5.0):
    """Turn the view to a body, from the side."""
    view = window.find_area("VIEW_3D").spaces.active.region_3d
    place = body.matrix_world @ body.pose.bones[0].head
    view.view_perspective, view.view_location = "PERSP", (place.x, place.y + 0.5, 0.8)
    view.view_rotation, view.view_distance = Euler((1.4, 0.0, 0.3)).to_quaternion(), distance


def check_the_button_shows_both_characters():
    bodies = yield from import_characters()
    yield from window.open_tab(window.find_area("VIEW_3D"), TAB)
    unfold_view_panel()
    yield from click_operator("show_momentum")
    yield from wait_until(list_shown, 20.0, "traced")
    assert len(list_shown()) == 2
    for frame in (25, 31, 36):
        bpy.context.scene.frame_set(frame)
        look_at(bodies[0])
        yield 0.5
        window.save_picture(PICTURES / f"momentum-{frame}.png")


def check_playing_is_quick():
    scene = bpy.context.scene
    momentum, draw = import_module("scene.overlays.momentum"), import_module("scene.overlays.draw")
    spent = []
    for frame in range(20, 60):
        scene.frame_set(frame)
        start = time.perf_counter()
        new = [item.meshes() for item in momentum.list_items(scene) if item.key[1] == "frame"]
        momentum.list_labels(scene)
        spent.append(1000.0 * (time.perf_counter() - start))
        assert len(new) == 2
    report_time("two characters, a new frame, ms", sorted(spent)[len(spent) // 2], 3.0)
    before = [shown for shown, _ in list_shown()]
    with bpy.context.temp_override(window=window.window):
        bpy.ops.screen.animation_play()
        yield 2.0
        bpy.ops.screen.animation_play()
    yield 1.0
    assert [shown for shown, _ in list_shown()] == before  # nothing was computed again
    assert len([key for key in draw._batches if key[0] in before]) <= 2 * 6  # a frame, and five seconds of lines


def check_an_edit_is_followed_once_the_user_is_idle():
    (shown, _), body = list_shown()[0], bpy.data.objects[CLIPS[0]]
    body.location.z += 0.5
    yield from wait_until(lambda: list_shown() and list_shown()[0][0] is not shown, 20.0, "traced again")
    assert abs(list_shown()[0][0].trace.centre[0, 2] - shown.trace.centre[0, 2] - 0.5) < 1e-3
    traced = list_shown()[0][0]
    yield 2.0
    assert list_shown()[0][0] is traced  # and then rests
    body.animation_data.action = None
    yield from wait_until(lambda: len(list_shown()) == 1, 20.0, "not drawn without an action")
    assert "plays no action" in body.beyond_mocap_momentum.message
    bpy.context.view_layer.objects.active = body
    yield from window.move_pointer(600, 300)  # its tooltip goes
    yield 1.0
    window.save_picture(PICTURES / "momentum-message.png")


def check_switches_deleting_and_undo_leave_nothing():
    draw = import_module("scene.overlays.draw")
    for name in ("momentum", "show"):
        setattr(get_settings().view, name, False)
        yield 0.4
        assert not [key for key in draw._batches if not isinstance(key[0], str)]
        setattr(get_settings().view, name, True)
        yield 0.4
        assert [key for key in draw._batches if not isinstance(key[0], str)]
    with bpy.context.temp_override(window=window.window):
        bpy.ops.ed.undo_push(message="before")
        bpy.data.objects.remove(bpy.data.objects[CLIPS[1]])
        bpy.ops.ed.undo_push(message="deleted")
        yield from wait_until(lambda: not list_shown(), 20.0, "the deleted one is not drawn")
        bpy.ops.ed.undo()
        yield from wait_until(lambda: len(list_shown()) == 1, 20.0, "undo brings it back")
    for body in bpy.context.scene.objects:
        body.select_set(True)
    run_operator("beyond_mocap.show_momentum", remove=True)
    yield 0.5
    assert not list_shown() and not [key for key in draw._batches if not isinstance(key[0], str)]
