"""The ball: aim it, hand it to Blender's physics, analyse hits, let a body carry it, solve it from tracking data."""

from __future__ import annotations

from dataclasses import replace

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..beyond_mocap.base.errors import InputError
from ..beyond_mocap.base.settings.aim import TIMES, WAYS
from ..beyond_mocap.base.settings.setting import BALLS, HOLDS, PARTS, SIDES
from ..scene.ball import handover, shots
from ..scene.ball.settings import aimed, aimed_ball, ball_meant, body_meant, target_meant
from ..scene.core import channels
from ..scene.core.measure import units_per_metre
from ..scene.core.settings import active_player
from ..scene.passes import hits_shown, possession, tracked
from ..scene.passes.settings import KEPT, ball_of, found_of, subject
from ..scene.stage import ball as balls
from .verb import BackgroundVerb, Verb

FAR = 10.0  # metres to a target that is made
NAME = "Aimed Ball"  # another than that of the takes' ball, which may lie in the same collection


class BEYOND_MOCAP_OT_aim_ball(Verb, bpy.types.Operator):
    """Let the selected armature strike the selected ball (a new one, if none is) so that it arrives at the selected
Empty (a new one, if none is). Drag the Empty: the ball follows. Without an armature the ball leaves
from where it lies"""

    bl_idname = "beyond_mocap.aim_ball"
    bl_label = "Aim Ball"
    part: EnumProperty(name="Part", items=PARTS, default="foot", description="What the ball is struck with")
    side: EnumProperty(name="Side", items=SIDES, default="right", description="Left or right, of what there are two")
    found: BoolProperty(
        name="Find the Strike", default=True,
        description="Take the ball stretch of the strike nearest to the current frame; else From and To",
    )
    first: IntProperty(name="From", default=1, description="First frame on which the ball may be struck")
    last: IntProperty(name="To", default=1, description="Last frame on which the ball may be struck")
    way: EnumProperty(name="Way", items=WAYS, default="AIR", description="How the ball gets there")
    bounces: IntProperty(name="Bounces", default=0, min=0, max=5,
                         description="How often it touches the ground before it arrives")
    timing: EnumProperty(name="Arrives", items=TIMES, default="FREE", description="When it arrives")
    seconds: FloatProperty(name="Flight", default=1.0, min=0.05, max=20.0,
                           description="Seconds from the strike to the target")
    arrival: IntProperty(name="Frame", default=50, description="Scene frame on which the ball arrives")
    ball: EnumProperty(name="Ball", items=BALLS, default="football", description="What kind of ball it is")
    needs = ("Select an armature that strikes, or a ball",
             lambda context: body_meant(context) is not None or ball_meant(context) is not None)

    def do(self, context):
        """Solve first, then make what is lacking and write."""
        shots.unsure()
        ball, scene = ball_meant(context), context.scene
        if ball is not None and ball.beyond_mocap_aim.on:
            channels.check_local(ball)
            solved = shots.solve(scene, shots.wish_of(scene, ball), ball.name)
            shots.write(scene, ball, solved)
        else:
            solved = self.new(context, ball)
        self.report({"INFO"}, "; ".join(shots.lines(solved)))

    def new(self, context, ball):
        """A ball that is not aimed yet."""
        body, scene, target = body_meant(context), context.scene, target_meant(context)
        channels.check_local(ball, body)
        shots.check_ball(ball)
        first, last = self.first, self.last
        if body is None:
            first = last = scene.frame_current
        elif self.found:
            first, last = shots.stretch_of(scene, body, self.part, self.side)
        names = ("part", "side", "way", "bounces", "timing", "seconds", "arrival", "ball")
        own = {name: getattr(self, name) for name in names}
        place = shots.place_of(scene, ball) if ball is not None else (0.0, 0.0, 0.0)
        wish = shots.Wish(body=body, bone="", first=first, last=last, target=(0.0, 0.0, 0.0), place=place, **own)
        there = shots.place_of(scene, target) if target is not None else shots.ahead(shots.strikes_of(scene, wish), FAR)
        wish = replace(wish, target=there)
        solved = shots.solve(scene, wish, ball.name if ball is not None else NAME)
        room = (body or ball).users_collection[0]
        if ball is None:
            ball = balls.create(context, NAME, room, shots.radius_of(wish))
            ball[KEPT] = True
        if target is None:
            target = bpy.data.objects.new(f"{ball.name} target", None)
            target.empty_display_type, target.empty_display_size = "SPHERE", 0.15 * units_per_metre(scene)
            target.location = [value * units_per_metre(scene) for value in there]
            room.objects.link(target)
            context.view_layer.update()
        shots.set_up(ball, wish, target)
        shots.write(scene, ball, solved)
        return solved


class BEYOND_MOCAP_OT_leave_aim(Verb, bpy.types.Operator):
    """The ball is not aimed any more: it plays what it did before, and its trajectory goes. The target stays"""

    bl_idname = "beyond_mocap.leave_aim"
    bl_label = "Leave Aim"

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("No ball is aimed" if not aimed(context.scene) else "Select an aimed ball or its target")
        ball = aimed_ball(context)
        if ball is not None and ball.beyond_mocap_aim.handed:
            cls.poll_message_set("Blender's physics has the ball: press Take Ball Back first")
            return False
        return ball is not None

    def do(self, context):
        """Bring back what it did."""
        shots.leave(aimed_ball(context))


class BEYOND_MOCAP_OT_ball_to_physics(Verb, bpy.types.Operator):
    """From the current frame on Blender's rigid bodies move the ball, as fast and with the spin that it has there:
keyed as Animated up to then, over a ground that is solid; other selected meshes are in its way. Play
from the start to see it"""

    bl_idname = "beyond_mocap.ball_to_physics"
    bl_label = "Ball to Physics"
    frame: IntProperty(name="Frame", default=0, min=0, description="Frame of the handover; 0: the current one")
    ball: EnumProperty(name="Ball", items=(("OWN", "Own", "The kind that it is aimed as"), *BALLS), default="OWN",
                       description="What kind of ball it is")
    needs = ("Select a ball that moves",
             lambda context: (ball := ball_meant(context)) is not None and ball.animation_data is not None
             and ball.animation_data.action is not None,
             "Blender's physics has this ball already", lambda context: ball_meant(context).rigid_body is None)

    def do(self, context):
        ball = ball_meant(context)
        frame = self.frame or context.scene.frame_current
        kind = ball.beyond_mocap_aim.ball if self.ball == "OWN" else self.ball
        chosen = [thing for thing in context.selected_objects if thing.type == "MESH" and thing.visible_get()]
        solid = [thing for thing in chosen if thing != ball]
        handover.hand_over(context.scene, ball, frame, kind, solid)
        self.report({"INFO"}, f"Physics has {ball.name} from frame {frame} on: play from the start")


class BEYOND_MOCAP_OT_ball_from_physics(Verb, bpy.types.Operator):
    """Blender's rigid bodies let go of the ball: it goes its keyed way again, and the solid ground goes"""

    bl_idname = "beyond_mocap.ball_from_physics"
    bl_label = "Take Ball Back"
    needs = ("Blender's physics has no ball that is selected",
             lambda context: (ball := ball_meant(context)) is not None and ball.beyond_mocap_aim.handed)

    def do(self, context):
        handover.take_back(context.scene, ball_meant(context))


class HitVerb(Verb):
    """A verb about an armature's strikes."""

    needs = "Select an armature with a motion", lambda context: subject(context) is not None


class BEYOND_MOCAP_OT_hit_analysis(HitVerb, bpy.types.Operator):
    """Find where the armature's foot, head, chest, hand or any bone can strike a ball: height and speed as a graph in
the panel, and markers on its action. A ball was never seen: the marked frame is the likeliest one"""

    bl_idname = "beyond_mocap.hit_analysis"
    bl_label = "Hit Analysis"
    part: EnumProperty(name="Part", items=PARTS, default="foot", description="The part whose strikes are looked for")
    side: EnumProperty(name="Side", items=SIDES, default="right", description="Left or right, of what there are two")
    threshold: FloatProperty(name="Threshold", default=0.0, min=0.0, max=5.0, precision=2,
                             description="Metres above which a strike may be; 0: automatic")
    bone: StringProperty(name="Bone", description="A bone by name, in place of the part")
    markers: BoolProperty(name="Markers", default=True, description="Set markers on the action")

    def invoke(self, context, _event):
        """With the choices of the panel."""
        hits = subject(context).beyond_mocap_hits
        self.part, self.side, self.threshold, self.bone = hits.part, hits.side, hits.threshold, hits.bone
        return self.execute(context)

    def do(self, context):
        body = subject(context)
        found = hits_shown.analyse(context.scene, body, self.part, side=self.side, threshold=self.threshold,
                                   bone=self.bone, markers=self.markers)
        count = len(found.motions)
        what = self.bone or self.part
        if not count:
            self.report({"WARNING"}, f"{body.name}: no strike of the {what} found; try the other side, or a threshold")
            return
        self.report({"INFO"}, f"{body.name}: {count} {'strike' if count == 1 else 'strikes'} of the {what}, "
                    f"above {found.threshold:.2f} m")


class BEYOND_MOCAP_OT_go_to_strike(Verb, bpy.types.Operator):
    """Go to the frame of this strike"""

    bl_idname = "beyond_mocap.go_to_strike"
    bl_label = "Go to Strike"
    frame: IntProperty(name="Frame", options={"SKIP_SAVE"}, description="Scene frame to go to")

    def do(self, context):
        context.scene.frame_set(self.frame)


class BEYOND_MOCAP_OT_clear_hits(HitVerb, bpy.types.Operator):
    """Forget the hit analysis of this armature, and take its markers away"""

    bl_idname = "beyond_mocap.clear_hits"
    bl_label = "Clear Hit Analysis"

    def do(self, context):
        body = subject(context)
        channels.check_local(body)
        if not found_of(body.beyond_mocap_hits):
            raise InputError(f"armature {body.name}", "no hit analysis", "one", "press Hit Analysis")
        played = channels.playing(body)[0]
        if played is not None and played.library is None:
            hits_shown.unmark(played)
        body.beyond_mocap_hits.property_unset("found")
        body.beyond_mocap_hits.property_unset("lines")


class BEYOND_MOCAP_OT_take_ball(Verb, bpy.types.Operator):
    """Let a hand or foot of the armature carry the ball from one frame to another, without a jump at either end: a
Child Of constraint with a keyed influence. The ball's own action is put aside; Free Ball brings it back"""

    bl_idname = "beyond_mocap.take_ball"
    bl_label = "Take Ball"
    part: EnumProperty(name="Part", items=PARTS, default="hand", description="What carries the ball")
    side: EnumProperty(name="Side", items=SIDES, default="right", description="Left or right, of what there are two")
    bone: StringProperty(name="Bone", description="A bone by name, in place of the part")
    first: IntProperty(name="From", default=1, description="Frame from which on it is carried")
    last: IntProperty(name="To", default=30, description="Frame on which it is let go")
    how: EnumProperty(name="Hold", items=HOLDS, default="KEEP", description="Where the ball is while it is carried")
    settle: IntProperty(name="Settle", default=4, min=1, max=1000,
                        description="Frames within which the ball comes to where it is carried")
    needs = ("Select an armature", lambda context: subject(context) is not None,
             "Select the ball beside the armature", lambda context: ball_of(context) is not None)

    def do(self, context):
        body, ball, scene = subject(context), ball_of(context), context.scene
        bone = self.bone or possession.bone_of(scene, body, self.part, self.side)
        skin = 0.03 if self.bone else possession.SURFACE.get(self.part, 0.03)
        possession.take(scene, ball, body, bone=bone, first=self.first, last=self.last, how=self.how,
                        settle=self.settle, skin=skin)
        self.report({"INFO"}, f"{body.name} carries {ball.name} with {bone} on frames {self.first} to {self.last}")


class BEYOND_MOCAP_OT_free_ball(Verb, bpy.types.Operator):
    """Take back that the ball is carried: at one stretch, or at all.
After the last one the ball plays its own action again"""

    bl_idname = "beyond_mocap.free_ball"
    bl_label = "Free Ball"
    number: IntProperty(name="Stretch", default=-1, min=-1, options={"SKIP_SAVE"}, description="Which one; -1: all")
    needs = ("Nobody carries the ball",
             lambda context: (ball := ball_of(context)) is not None and len(ball.beyond_mocap_ball.holds) > 0)

    def do(self, context):
        ball = ball_of(context)
        if self.number >= len(ball.beyond_mocap_ball.holds):
            raise InputError("stretch", f"number {self.number}", f"below {len(ball.beyond_mocap_ball.holds)}")
        possession.free(context.scene, ball, None if self.number < 0 else self.number)


class BEYOND_MOCAP_OT_solve_ball(BackgroundVerb, bpy.types.Operator):
    """Work out of the imported tracking who touches the ball and when, and its way between. The ball becomes an object,
its touches proposals for key moments"""

    bl_idname = "beyond_mocap.solve_ball"
    bl_label = "Solve Ball"
    kind = "ball"
    needs = ("Import tracking in step 2 first",
             lambda context: (player := active_player(context.scene.beyond_mocap)) is not None
             and bool(player.tracking_file))

    def order(self, context):
        """What is to be solved."""
        return tracked.order_of(context.scene)

    work = staticmethod(tracked.work)

    def apply(self, scene, solved):
        """The ball, and the list of touches."""
        tracked.write(scene, solved)
        self.report({"INFO"},
                    f"{len(solved.touches)} touches solved, with {solved.confidence:.0%} confidence in the mean")


class BEYOND_MOCAP_OT_accept_touches(Verb, bpy.types.Operator):
    """Make key moments of the ticked touches, at their solved times. Where a player has a key moment near by already,
none is added"""

    bl_idname = "beyond_mocap.accept_touches"
    bl_label = "Accept Touches"
    active: BoolProperty(name="Active Player", default=False, options={"SKIP_SAVE"},
                         description="Only those of the active player")
    needs = "Press Solve Ball first", lambda context: len(context.scene.beyond_mocap_passes.touches) > 0

    def do(self, context):
        player = active_player(context.scene.beyond_mocap)
        if self.active and player is None:
            raise InputError("player", "none in the list", "one", "import tracking in step 2")
        count, told = tracked.accept(context, player.name if self.active else "")
        if not count and not told:
            raise InputError("touches", "none is ticked that has words and a player of the list", "one",
                             "tick some in the list")
        for line in told[:5]:
            self.report({"INFO"}, line)
        self.report({"INFO"}, f"{count} key moments added")
