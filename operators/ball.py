"""Operators of the ball: aim it, hand it over to Blender's physics, analyse hits, attach it to a body, solve it from
tracking data.
"""

from dataclasses import replace

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..beyond_mocap.base.errors import InputError, format_count
from ..beyond_mocap.base.fixes import Fix
from ..beyond_mocap.base.settings.aim import TIMES, WAYS
from ..beyond_mocap.base.settings.setting import BALLS, HOLDS, PARTS, SIDES
from ..scene.ball import handover, shots
from ..scene.ball.settings import (
    find_aimed_ball,
    find_selected_ball,
    find_selected_body,
    find_selected_target,
    list_aimed_balls,
)
from ..scene.core import channels
from ..scene.core.measure import units_per_metre
from ..scene.core.settings import find_active_player
from ..scene.passes import hit_analysis as hits_shown
from ..scene.passes import possession, tracked
from ..scene.passes.settings import KEPT, find_armature, find_ball, parse_hits
from ..scene.stage import ball as balls
from .operator_base import BackgroundOperator, BaseOperator

TARGET_DISTANCE = 10.0  # m to a new target
BALL_NAME = "Aimed Ball"  # differs from the takes' ball, which may be in the same collection


class BEYOND_MOCAP_OT_aim_ball(BaseOperator, bpy.types.Operator):
    """Let the selected armature strike the selected ball so that it arrives at the selected Empty, which can be
dragged; a missing ball or Empty is created, and without an armature the ball starts where it lies"""

    bl_idname = "beyond_mocap.aim_ball"
    bl_label = "Aim Ball"
    part: EnumProperty(name="Part", items=PARTS, default="foot", description="Body part that strikes the ball")
    side: EnumProperty(name="Side", items=SIDES, default="right", description="Left or right body part")
    found: BoolProperty(
        name="Find Strike", default=True,
        description="Use the strike nearest to the current frame; off: use From and To",
    )
    first: IntProperty(name="From", default=1, description="First frame on which the ball can be struck")
    last: IntProperty(name="To", default=1, description="Last frame on which the ball can be struck")
    way: EnumProperty(name="Trajectory", items=WAYS, default="AIR", description="How the ball reaches the target")
    bounces: IntProperty(name="Bounces", default=0, min=0, max=5,
                         description="Number of bounces before it arrives")
    timing: EnumProperty(name="Arrives", items=TIMES, default="FREE", description="When the ball arrives")
    seconds: FloatProperty(name="Flight", default=1.0, min=0.05, max=20.0,
                           description="Seconds from the strike to the target")
    arrival: IntProperty(name="Frame", default=50, description="Scene frame on which the ball arrives")
    ball: EnumProperty(name="Ball", items=BALLS, default="football", description="Kind of ball")
    needs = ("Select an armature that strikes, or a ball",
             lambda context: find_selected_body(context) is not None or find_selected_ball(context) is not None)

    def do(self, context):
        """Solve first, then create what is missing and write."""
        shots.clear_strikes()
        ball, scene = find_selected_ball(context), context.scene
        if ball is not None and ball.beyond_mocap_aim.on:
            channels.check_local(ball)
            solved = shots.solve_request(scene, shots.build_request(scene, ball), ball.name)
            shots.write_shot(scene, ball, solved)
        else:
            solved = self.create_aimed_ball(context, ball)
        self.report({"INFO"}, "; ".join(shots.describe_shot(solved)))

    def create_aimed_ball(self, context, ball):
        """Create and aim a ball that is not aimed yet."""
        body, scene, target = find_selected_body(context), context.scene, find_selected_target(context)
        channels.check_local(ball, body)
        shots.check_ball(ball)
        first, last = self.first, self.last
        if body is None:
            first = last = scene.frame_current
        elif self.found:
            first, last = shots.find_strike_frames(scene, body, self.part, self.side)
        names = ("part", "side", "way", "bounces", "timing", "seconds", "arrival", "ball")
        values = {name: getattr(self, name) for name in names}
        place = shots.measure_position(scene, ball) if ball is not None else (0.0, 0.0, 0.0)
        request = shots.ShotRequest(body=body, bone="", first=first, last=last, target=(0.0, 0.0, 0.0), place=place,
                                    **values)
        target_position = shots.measure_position(scene,
                                                 target) if target is not None else shots.find_place_ahead(
            shots.find_strikes(scene, request), TARGET_DISTANCE)
        request = replace(request, target=target_position)
        solved = shots.solve_request(scene, request, ball.name if ball is not None else BALL_NAME)
        collection = (body or ball).users_collection[0]
        if ball is None:
            ball = balls.create_ball(context, BALL_NAME, collection, shots.find_radius(request))
            ball[KEPT] = True
        if target is None:
            target = bpy.data.objects.new(f"{ball.name} target", None)
            target.empty_display_type, target.empty_display_size = "SPHERE", 0.15 * units_per_metre(scene)
            target.location = [value * units_per_metre(scene) for value in target_position]
            collection.objects.link(target)
            context.view_layer.update()
        shots.apply_request(ball, request, target)
        shots.write_shot(scene, ball, solved)
        return solved


class BEYOND_MOCAP_OT_leave_aim(BaseOperator, bpy.types.Operator):
    """Stop aiming the ball, restore its earlier animation and remove its trajectory; the target stays"""

    bl_idname = "beyond_mocap.leave_aim"
    bl_label = "Revert Aim"

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("No ball is aimed" if not list_aimed_balls(context.scene)
                             else "Select an aimed ball or its target")
        ball = find_aimed_ball(context)
        if ball is not None and ball.beyond_mocap_aim.handed:
            cls.poll_message_set("Blender's physics moves the ball: press Ball from Physics first")
            return False
        return ball is not None

    def do(self, context):
        """Restore its earlier animation."""
        shots.remove_aim(find_aimed_ball(context))


class BEYOND_MOCAP_OT_ball_to_physics(BaseOperator, bpy.types.Operator):
    """Let Blender's rigid bodies move the ball from the current frame on, with its velocity and spin there, over a
solid ground and against other selected meshes; play from the start to see it"""

    bl_idname = "beyond_mocap.ball_to_physics"
    bl_label = "Ball to Physics"
    frame: IntProperty(name="Frame", default=0, min=0, description="Frame of the handover; 0: the current one")
    ball: EnumProperty(name="Ball", items=(("OWN", "As Aimed", "The kind it is aimed as"), *BALLS), default="OWN",
                       description="Kind of ball")
    needs = ("Select a ball that moves", lambda context: (ball := find_selected_ball(context)) is not None
             and ball.animation_data is not None and ball.animation_data.action is not None,
             "Blender's physics moves this ball already",
             lambda context: find_selected_ball(context).rigid_body is None)

    def do(self, context):
        ball = find_selected_ball(context)
        frame = self.frame or context.scene.frame_current
        kind = ball.beyond_mocap_aim.ball if self.ball == "OWN" else self.ball
        chosen = [thing for thing in context.selected_objects if thing.type == "MESH" and thing.visible_get()]
        solid = [thing for thing in chosen if thing != ball]
        handover.start_physics(context.scene, ball, frame, kind, solid)
        self.report({"INFO"}, f"Physics moves {ball.name} from frame {frame} on: play from the start")


class BEYOND_MOCAP_OT_ball_from_physics(BaseOperator, bpy.types.Operator):
    """Return the ball from Blender's rigid bodies to its keys, and remove the solid ground"""

    bl_idname = "beyond_mocap.ball_from_physics"
    bl_label = "Ball from Physics"
    needs = ("Select a ball that Blender's physics moves",
             lambda context: (ball := find_selected_ball(context)) is not None and ball.beyond_mocap_aim.handed)

    def do(self, context):
        handover.stop_physics(context.scene, find_selected_ball(context))


class HitVerb(BaseOperator):
    """An operator on an armature's strikes."""

    needs = "Select an armature with a motion", lambda context: find_armature(context) is not None


class BEYOND_MOCAP_OT_hit_analysis(HitVerb, bpy.types.Operator):
    """Find where a body part or bone can strike a ball, show height and speed as a graph in the panel and set markers
on the action; without ball data, the marked frame is the most likely one"""

    bl_idname = "beyond_mocap.hit_analysis"
    bl_label = "Hit Analysis"
    part: EnumProperty(name="Part", items=PARTS, default="foot", description="Body part whose strikes are found")
    side: EnumProperty(name="Side", items=SIDES, default="right", description="Left or right body part")
    threshold: FloatProperty(name="Threshold", default=0.0, min=0.0, max=5.0, precision=2,
                             description="Least height of a strike, in metres; 0: automatic")
    bone: StringProperty(name="Bone", description="A bone by name, in place of the part")
    markers: BoolProperty(name="Markers", default=True, description="Set markers on the action")

    def invoke(self, context, _event):
        """Run with the settings of the panel."""
        hits = find_armature(context).beyond_mocap_hits
        self.part, self.side, self.threshold, self.bone = hits.part, hits.side, hits.threshold, hits.bone
        return self.execute(context)

    def do(self, context):
        body = find_armature(context)
        found = hits_shown.analyse_armature(context.scene, body, self.part, side=self.side, threshold=self.threshold,
                                            bone=self.bone, markers=self.markers)
        count = len(found.motions)
        what = self.bone or self.part
        if not count:
            self.report({"WARNING"}, f"{body.name}: no strike of the {what} found; try the other side, or a threshold")
            return
        self.report({"INFO"}, f"{body.name}: {format_count(count, 'strike')} of the {what}, "
                    f"above {found.threshold:.2f} m")


class BEYOND_MOCAP_OT_go_to_strike(BaseOperator, bpy.types.Operator):
    """Go to the frame of this strike"""

    bl_idname = "beyond_mocap.go_to_strike"
    bl_label = "Go to Strike"
    frame: IntProperty(name="Frame", options={"SKIP_SAVE"}, description="Scene frame to go to")

    def do(self, context):
        context.scene.frame_set(self.frame)


class BEYOND_MOCAP_OT_clear_hits(HitVerb, bpy.types.Operator):
    """Clear the hit analysis of this armature and remove its markers"""

    bl_idname = "beyond_mocap.clear_hits"
    bl_label = "Clear Hit Analysis"

    def do(self, context):
        body = find_armature(context)
        channels.check_local(body)
        if not parse_hits(body.beyond_mocap_hits):
            raise InputError(f"armature {body.name}", "no hit analysis", "a hit analysis", "press Hit Analysis",
                             fixes=(Fix("press", "beyond_mocap.hit_analysis"),))
        played = channels.find_playing_action(body)[0]
        if played is not None and played.library is None:
            hits_shown.remove_markers(played)
        body.beyond_mocap_hits.property_unset("found")
        body.beyond_mocap_hits.property_unset("lines")


class BEYOND_MOCAP_OT_take_ball(BaseOperator, bpy.types.Operator):
    """Attach the ball to a hand or foot of the armature from one frame to another, with a Child Of constraint and
smooth transitions; Free Ball restores the ball's own action"""

    bl_idname = "beyond_mocap.take_ball"
    bl_label = "Take Ball"
    part: EnumProperty(name="Part", items=PARTS, default="hand", description="Body part that carries the ball")
    side: EnumProperty(name="Side", items=SIDES, default="right", description="Left or right body part")
    bone: StringProperty(name="Bone", description="A bone by name, in place of the part")
    first: IntProperty(name="From", default=1, description="First frame on which the ball is carried")
    last: IntProperty(name="To", default=30, description="Frame on which the ball is released")
    how: EnumProperty(name="Hold", items=HOLDS, default="KEEP", description="Where the ball is while it is carried")
    settle: IntProperty(name="Settle", default=4, min=1, max=1000,
                        description="Frames in which the ball moves to where it is carried")
    needs = ("Select an armature", lambda context: find_armature(context) is not None,
             "Select the ball beside the armature", lambda context: find_ball(context) is not None)

    def do(self, context):
        body, ball, scene = find_armature(context), find_ball(context), context.scene
        bone = self.bone or possession.find_bone(scene, body, self.part, self.side)
        skin = 0.03 if self.bone else possession.SKIN_DISTANCES.get(self.part, 0.03)
        possession.add_hold(scene, ball, body, bone=bone, first=self.first, last=self.last, mode=self.how,
                            settle=self.settle, skin=skin)
        self.report({"INFO"}, f"{body.name} carries {ball.name} with {bone} on frames {self.first} to {self.last}")


class BEYOND_MOCAP_OT_free_ball(BaseOperator, bpy.types.Operator):
    """Release the ball from one carried stretch, or from all; after the last one it plays its own action again"""

    bl_idname = "beyond_mocap.free_ball"
    bl_label = "Free Ball"
    number: IntProperty(name="Stretch", default=-1, min=-1, options={"SKIP_SAVE"}, description="Stretch; -1: all")
    needs = ("The ball is not carried",
             lambda context: (ball := find_ball(context)) is not None and len(ball.beyond_mocap_ball.holds) > 0)

    def do(self, context):
        ball = find_ball(context)
        if self.number >= len(ball.beyond_mocap_ball.holds):
            raise InputError("stretch", f"number {self.number}", f"below {len(ball.beyond_mocap_ball.holds)}")
        possession.remove_holds(context.scene, ball, None if self.number < 0 else self.number)


class BEYOND_MOCAP_OT_solve_ball(BackgroundOperator, bpy.types.Operator):
    """Find from the imported tracking who touches the ball and when, and its trajectory; the ball becomes an object,
and its touches are proposals for key moments"""

    bl_idname = "beyond_mocap.solve_ball"
    bl_label = "Solve Ball"
    kind = "ball"
    needs = ("Import tracking in step 2 first",
             lambda context: (player := find_active_player(context.scene.beyond_mocap)) is not None
             and bool(player.tracking_file))

    def order(self, context):
        """Build the request."""
        return tracked.build_order(context.scene)

    @staticmethod
    def run_job(order, progress, cancelled, hurry):
        """Solve it."""
        return tracked.run_order(order, progress, cancelled, hurry)

    def apply(self, scene, solved):
        """Create the ball and the list of touches."""
        tracked.write_ball(scene, solved)
        count = format_count(len(solved.touches), "touch", "touches")
        self.report({"INFO"}, f"{count} solved, mean confidence {solved.confidence:.0%}")


class BEYOND_MOCAP_OT_accept_touches(BaseOperator, bpy.types.Operator):
    """Add key moments for the selected touches, at their solved times, unless the player has a key moment close to
them"""

    bl_idname = "beyond_mocap.accept_touches"
    bl_label = "Apply Touches"
    active: BoolProperty(name="Active Player", default=False, options={"SKIP_SAVE"},
                         description="Only touches of the active player")
    needs = "Press Solve Ball first", lambda context: len(context.scene.beyond_mocap_passes.touches) > 0

    def do(self, context):
        player = find_active_player(context.scene.beyond_mocap)
        if self.active and player is None:
            raise InputError("player", "none in the list", "a player", "import tracking in step 2",
                             fixes=(Fix("add_track"),))
        count, messages = tracked.accept_touches(context, player.name if self.active else "")
        if not count and not messages:
            raise InputError("touches", "none selected with labels and a player of the list", "at least one",
                             "select some in the list")
        for line in messages[:5]:
            self.report({"INFO"}, line)
        self.report({"INFO"}, f"{format_count(count, 'key moment')} added")
