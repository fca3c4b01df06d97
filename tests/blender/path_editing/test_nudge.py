"""Control points go by steps along the axes of the world, whatever the curve is and however its object lies."""

from importlib import import_module

import bpy
import numpy as np
import pytest
from conftest import EXTENSION


def curve(kind):
    """A curve of four points a metre apart, turned and twice as large, in edit mode with nothing selected."""
    data = bpy.data.curves.new("Drawn", "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new(kind)
    points = spline.bezier_points if kind == "BEZIER" else spline.points
    points.add(3)
    for number, point in enumerate(points):
        point.co = (number, 0.0, 0.0) if kind == "BEZIER" else (number, 0.0, 0.0, 1.0)
        if kind == "BEZIER":
            point.handle_left_type = point.handle_right_type = "AUTO"
    drawn = bpy.data.objects.new("Drawn", data)
    drawn.rotation_euler.z, drawn.scale = 1.1, (2.0, 2.0, 2.0)
    bpy.context.scene.collection.objects.link(drawn)
    bpy.context.view_layer.objects.active = drawn
    drawn.select_set(True)
    bpy.context.view_layer.update()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.curve.select_all(action="DESELECT")
    return drawn


def points(drawn):
    spline = drawn.data.splines[0]
    return spline.bezier_points if spline.type == "BEZIER" else spline.points


def places(drawn):
    """World places (P, 3) of the control points."""
    return np.array([drawn.matrix_world @ point.co.to_3d() for point in points(drawn)])


def select(drawn, *which):
    for number in which:
        point = points(drawn)[number]
        if drawn.data.splines[0].type == "BEZIER":
            point.select_control_point = point.select_left_handle = point.select_right_handle = True
        else:
            point.select = True


STEPS = {"LEFT": (-1, 0, 0), "RIGHT": (1, 0, 0), "FORTH": (0, 1, 0), "BACK": (0, -1, 0), "UP": (0, 0, 1),
         "DOWN": (0, 0, -1)}


@pytest.mark.parametrize("kind", ["BEZIER", "NURBS", "POLY"])
def test_the_selected_points_go_one_step_and_no_other(kind):
    drawn = curve(kind)
    for direction, way in STEPS.items():
        before = places(drawn)
        bpy.ops.curve.select_all(action="DESELECT")
        select(drawn, 1, 2)
        assert bpy.ops.beyond_mocap.nudge_points(direction=direction, step=0.25) == {"FINISHED"}
        moved = places(drawn) - before
        assert np.allclose(moved[[1, 2]], 0.25 * np.array(way), atol=1e-5) and np.allclose(
            moved[[0, 3]], 0.0, atol=1e-6
        )


@pytest.mark.parametrize("scale", [1.0, 0.01])
def test_the_step_is_the_scene_s_in_metres(scale):
    bpy.context.scene.unit_settings.scale_length = scale
    bpy.context.scene.beyond_mocap.nudge_step = 0.5
    drawn = curve("NURBS")
    select(drawn, 3)
    before = places(drawn)
    bpy.ops.beyond_mocap.nudge_points(direction="FORTH")
    assert np.allclose((places(drawn) - before)[3] * scale, (0.0, 0.5, 0.0), atol=1e-4)


def test_a_handle_goes_alone_and_a_point_with_its_handles():
    drawn = curve("BEZIER")
    point = points(drawn)[1]
    point.select_right_handle = True
    place, handle = point.co.copy(), point.handle_right.copy()
    bpy.ops.beyond_mocap.nudge_points(direction="FORTH", step=0.2)
    point = points(drawn)[1]
    turned = drawn.matrix_world.to_3x3()
    assert np.allclose(turned @ (point.handle_right - handle), (0.0, 0.2, 0.0), atol=1e-5) and point.co == place
    arm = point.handle_right - point.co
    select(drawn, 1)
    bpy.ops.beyond_mocap.nudge_points(direction="RIGHT", step=0.2)
    assert np.allclose(points(drawn)[1].handle_right - points(drawn)[1].co, arm, atol=1e-5)


def test_snapping_and_proportional_editing_have_no_part_in_it():
    tools = bpy.context.scene.tool_settings
    tools.use_snap, tools.use_proportional_edit, tools.proportional_distance = True, True, 10.0
    drawn = curve("NURBS")
    select(drawn, 0)
    before = places(drawn)
    bpy.ops.beyond_mocap.nudge_points(direction="UP", step=0.03)
    assert np.allclose(places(drawn) - before, [(0, 0, 0.03), (0, 0, 0), (0, 0, 0), (0, 0, 0)], atol=1e-5)


def test_one_step_of_undo():
    drawn = curve("NURBS")
    select(drawn, 2)
    bpy.ops.ed.undo_push(message="before")
    before = places(drawn)
    for _ in range(2):
        bpy.ops.beyond_mocap.nudge_points("EXEC_DEFAULT", True, direction="UP", step=0.3)
    bpy.ops.ed.undo()
    assert np.allclose(places(bpy.data.objects["Drawn"])[2] - before[2], (0.0, 0.0, 0.3), atol=1e-5)
    bpy.ops.ed.undo()
    assert np.allclose(places(bpy.data.objects["Drawn"]), before)
    bpy.ops.ed.redo()
    assert np.allclose(places(bpy.data.objects["Drawn"])[2] - before[2], (0.0, 0.0, 0.3), atol=1e-5)


def test_what_is_missing_is_said():
    with pytest.raises(RuntimeError, match="edit mode"):
        bpy.ops.beyond_mocap.nudge_points()
    curve("BEZIER")
    with pytest.raises(RuntimeError, match="no control point is selected"):
        bpy.ops.beyond_mocap.nudge_points()


def test_our_keys_are_free_in_blender_s_own_configurations():
    """Read from the tables that Blender builds its configurations of."""
    import sys

    keymap = import_module(f"{EXTENSION}.operators.keymap")
    folder = f"{bpy.utils.system_resource('SCRIPTS')}/presets/keyconfig"
    sys.path.insert(0, folder)
    try:
        tables = [import_module(f"keymap_data.{name}") for name in ("blender_default", "industry_compatible_data")]
    finally:
        sys.path.remove(folder)
    ours = {(entry.key, frozenset(entry.modifiers)) for entry in keymap.ENTRIES
            if entry.operator in ("beyond_mocap.nudge_points", "beyond_mocap.path_camera")}
    assert len(ours) == 8
    everywhere = {"Window", "Screen", "Frames", "3D View", "3D View Generic", "Object Mode", "Object Non-modal", "Pose",
                  "Curve"}
    for table in tables:
        taken = {(item[1]["type"], frozenset(held for held in ("ctrl", "shift", "alt", "oskey") if item[1].get(held)))
                 for name, _, content in table.generate_keymaps(table.Params()) if name in everywhere
                 for item in content["items"]}
        assert len(taken) > 100 and not ours & taken, table.__name__
