"""Path editing: let a motion follow a curve that can be edited, avoid collisions, apply or revert it."""

from contextlib import suppress

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from ..beyond_mocap.base.errors import BeyondMocapError, InputError, format_count
from ..beyond_mocap.base.settings.path_editing import CURVES
from ..scene.core import channels
from ..scene.core.measure import units_per_metre
from ..scene.path_editing import collision_avoidance as keep_apart
from ..scene.path_editing import edited_bodies, live
from ..scene.path_editing.settings import MOST_DEGREE, SHAPES, list_edited_bodies, list_target_bodies, select_object
from .operator_base import NEEDS_NO_EDITING, BaseOperator


class EditedBodyVerb(BaseOperator):
    """A verb about edited bodies; disabled, with the reason, without any."""

    needs = "Select an armature that follows a path, or its curve", lambda context: bool(list_target_bodies(context))


COUNT = {"name": "Points", "default": 0, "min": 0, "max": 200,
         "description": "Number of control points of the curve; 0: as many as it needs to stay within 3 cm"}
DEGREE = {"name": "Degree", "default": 3, "min": 1, "max": MOST_DEGREE,
          "description": "Degree of a NURBS curve: how smooth it is, and how far each control point reaches"}


class BEYOND_MOCAP_OT_edit_path(BaseOperator, bpy.types.Operator):
    """Let the motion of the selected armature follow a curve that can be edited (Tab): a new one along its own path, or
a selected curve"""

    bl_idname = "beyond_mocap.edit_path"
    bl_label = "Edit Path"
    count: IntProperty(**COUNT)
    kind: EnumProperty(name="Curve", items=CURVES, default="BEZIER", description="Kind of the new curve")
    degree: IntProperty(**DEGREE)
    straight: BoolProperty(name="Straight", description="A straight line as long as the original path")
    needs = (*NEEDS_NO_EDITING, "Select an armature with a motion, and optionally a curve as its new path",
             lambda context: bool(list_armatures(context)))

    def do(self, context):
        """Create the curve, start the path edits and select the curve."""
        channels.check_local(context.scene)
        chosen = list_armatures(context)
        drawn = next((thing for thing in context.selected_objects if thing.type == "CURVE"), None)
        already_edited = [(body, body.beyond_mocap_ride.curve) for body in chosen if body.beyond_mocap_ride.on]
        if drawn is None and len(already_edited) == len(chosen):
            raise InputError(f"armature {chosen[0].name}", "already follows a path", "an armature without a path edit",
                             "edit its curve, or press Revert")
        started, used = [], drawn
        try:
            for body, _ in already_edited if drawn is not None else ():
                edited_bodies.change_curve(context.scene, body, drawn)
            for body in [body for body in chosen if not body.beyond_mocap_ride.on]:
                before = body.beyond_mocap_ride.curve
                created = edited_bodies.start_path_edit(context, body, drawn, count=self.count, kind=self.kind,
                                                        degree=self.degree, straight=self.straight)
                started.append((body, before, created if created not in (drawn, before) else None))
                used = used or created
        except BeyondMocapError:
            for body, before, created in started:
                edited_bodies.undo_start(body, before, created)
            for body, before in already_edited:
                with suppress(BeyondMocapError):  # a body that could not follow its curve before still cannot
                    edited_bodies.change_curve(context.scene, body, before)
            raise
        if context.mode == "POSE":
            bpy.ops.object.mode_set(mode="OBJECT")
        select_object(context, used)
        names = ", ".join(body.name for body in chosen)
        self.report({"INFO"}, f"{names}: edit the points of {used.name} (Tab); the motion follows")


def list_armatures(context) -> list[bpy.types.Object]:
    """List the armatures to edit: the active one first, then the other selected ones."""
    active = context.view_layer.objects.active
    return sorted((thing for thing in context.selected_objects if thing.type == "ARMATURE"),
                  key=lambda thing: thing != active)


class BEYOND_MOCAP_OT_path_curve(BaseOperator, bpy.types.Operator):
    """Create another curve for the armature: along the original path, straight, or along the current path with other
points"""

    bl_idname = "beyond_mocap.path_curve"
    bl_label = "New Curve"
    shape: EnumProperty(name="Shape", items=SHAPES, default="FITTED", description="Shape of the new curve")
    count: IntProperty(**COUNT)
    kind: EnumProperty(name="Curve", items=CURVES, default="BEZIER", description="Kind of the new curve")
    degree: IntProperty(**DEGREE)
    needs = (*NEEDS_NO_EDITING, "Select an armature that follows a path, or its curve",
             lambda context: bool(list_target_bodies(context)))

    def do(self, context):
        """Create the curve and make it active."""
        body = list_target_bodies(context)[0]
        created = edited_bodies.create_new_curve(context, body, self.shape, count=self.count, kind=self.kind,
                                                 degree=self.degree)
        if context.mode == "POSE":
            bpy.ops.object.mode_set(mode="OBJECT")
        select_object(context, created)


class BEYOND_MOCAP_OT_update_path(EditedBodyVerb, bpy.types.Operator):
    """Update the motion on its path: after edits of the original action, in a script, or while Update Automatically is
off"""

    bl_idname = "beyond_mocap.update_path"
    bl_label = "Update Path"

    def do(self, context):
        for body in list_target_bodies(context):
            edited_bodies.update_motion(context.scene, body, force=True)
            live.measure_body(context.scene, body)


class BEYOND_MOCAP_OT_path_apart(BaseOperator, bpy.types.Operator):
    """Find collisions of bodies on paths, with each other and with other bodies, and resolve them by small waits and
detours of all or of two or more selected bodies"""

    bl_idname = "beyond_mocap.path_apart"
    bl_label = "Avoid Collisions"
    distance: FloatProperty(name="Distance", default=0.6, min=0.05, max=20.0, soft_max=2.0, precision=2,
                            description="Least distance between the middles of two bodies, in metres")
    delay: FloatProperty(name="Longest Wait", default=2.0, min=0.0, max=60.0, soft_max=10.0, precision=2,
                         unit="TIME_ABSOLUTE", description="Longest wait of a body before it starts")
    detour: FloatProperty(name="Widest Detour", default=0.8, min=0.0, max=20.0, soft_max=3.0, precision=2,
                          description="Largest distance of a detour from the path, in metres")
    clear: BoolProperty(name="Clear", description="Only remove all waits and detours")
    needs = "Let an armature follow a path first (Edit Path)", lambda context: bool(list_edited_bodies(context.scene))

    def do(self, context):
        from ..beyond_mocap.path_editing.detour import PathChange
        from ..beyond_mocap.path_editing.remedies import Limits

        bodies = list_target_bodies(context)
        bodies = bodies if len(bodies) > 1 else list_edited_bodies(context.scene)
        if self.clear:
            keep_apart.apply_changes(context.scene, bodies, [PathChange()] * len(bodies))
            return
        result = keep_apart.compute_changes(context, bodies,
                                            Limits(self.distance, delay=self.delay, detour=self.detour))
        keep_apart.apply_changes(context.scene, bodies, result.changes)
        self.report_result(result)

    def report_result(self, result):
        """Report the collisions and the changes."""
        if not result.before and not result.unresolved:
            self.report({"INFO"}, f"No bodies come within {self.distance:.2f} m of each other")
            return
        lines = "; ".join([format_count(result.before, "collision"), *keep_apart.describe_result(result)])
        self.report({"WARNING"} if result.unresolved else {"INFO"}, lines)


class BEYOND_MOCAP_OT_bake_path(EditedBodyVerb, bpy.types.Operator):
    """Turn the motion on its new path into an ordinary action with a key on every frame; the original action and the
curve stay in the file"""

    bl_idname = "beyond_mocap.bake_path"
    bl_label = "Apply"

    def do(self, context):
        """Apply all target bodies; where a motion cannot be updated, its last state."""
        chosen = list_target_bodies(context)
        for body in chosen:
            edited_bodies.check_can_apply(body)
        applied = [edited_bodies.apply_path_edit(context.scene, body) for body in chosen]
        edited_bodies.select_again(context, chosen)
        self.report({"INFO"}, f"applied as {', '.join(action.name for action, _ in applied)}")
        for line in (reason for _, reason in applied if reason):
            self.report({"WARNING"}, f"the motion cannot be updated, so its last state is applied: {line}")


class BEYOND_MOCAP_OT_leave_path(EditedBodyVerb, bpy.types.Operator):
    """Restore the armature's original motion exactly; the curve stays in the scene for the next Edit Path"""

    bl_idname = "beyond_mocap.leave_path"
    bl_label = "Revert"

    def do(self, context):
        chosen = list_target_bodies(context)
        edited_bodies.revert_path_edits(*chosen)
        edited_bodies.select_again(context, chosen)


DIRECTIONS = (("LEFT", "Left", "Along -X", "TRIA_LEFT", 0), ("RIGHT", "Right", "Along X", "TRIA_RIGHT", 1),
              ("FORTH", "Forward", "Along Y", "TRIA_UP", 2), ("BACK", "Back", "Along -Y", "TRIA_DOWN", 3),
              ("UP", "Up", "Along Z", "SORT_DESC", 4), ("DOWN", "Down", "Along -Z", "SORT_ASC", 5))
AXES = {"LEFT": (-1.0, 0.0, 0.0), "RIGHT": (1.0, 0.0, 0.0), "BACK": (0.0, -1.0, 0.0), "FORTH": (0.0, 1.0, 0.0),
        "UP": (0.0, 0.0, 1.0), "DOWN": (0.0, 0.0, -1.0)}


class BEYOND_MOCAP_OT_nudge_points(BaseOperator, bpy.types.Operator):
    """Move the selected control points or handles by one step along a world axis"""

    bl_idname = "beyond_mocap.nudge_points"
    bl_label = "Nudge Points"
    direction: EnumProperty(name="Direction", items=DIRECTIONS, default="RIGHT", description="Direction in the world")
    step: FloatProperty(name="Step", default=0.0, min=0.0, precision=3, options={"SKIP_SAVE"},
                        description="Metres to move; 0: the step set in the Path Editing panel")
    needs = "Select a curve and enter edit mode (Tab) first", lambda context: context.mode == "EDIT_CURVE"

    @classmethod
    def description(cls, _context, properties):
        """Return the tooltip with the shortcut."""
        axis_text = next(item[2].lower() for item in DIRECTIONS if item[0] == properties.direction)
        key = {"FORTH": "Up Arrow", "BACK": "Down Arrow", "UP": "Page Up", "DOWN": "Page Down"}
        return (f"Move the selected control points or handles by one step, {axis_text} of the world\n"
                f"Alt + {key.get(properties.direction) or properties.direction.capitalize() + ' Arrow'}")

    def do(self, context):
        """Move by Blender's own operator, which also updates neighbouring handles."""
        step = (self.step or context.scene.beyond_mocap.nudge_step) * units_per_metre(context.scene)
        moved = bpy.ops.transform.translate("EXEC_DEFAULT", value=[step * part for part in AXES[self.direction]],
                                            orient_type="GLOBAL", mirror=False, use_proportional_edit=False, snap=False)
        if moved != {"FINISHED"}:
            raise InputError("nudge", "no control point is selected", "one or more", "click on a point first")
