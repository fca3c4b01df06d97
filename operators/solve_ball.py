"""Solve Ball: touches and the ball's way from imported tracking. Accept Touches: key moments of them."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty

from ..beyond_mocap.errors import InputError
from ..scene.passes import tracked
from ..scene.settings import active_player
from .verb import BackgroundVerb, Verb


class BEYOND_MOCAP_OT_solve_ball(BackgroundVerb, bpy.types.Operator):
    """Work out of the imported tracking who touches the ball and when, and its way between. The ball becomes an object,
its touches proposals for key moments"""

    bl_idname = "beyond_mocap.solve_ball"
    bl_label = "Solve Ball"
    kind = "ball"

    @classmethod
    def poll(cls, context):
        """Somebody with a file."""
        cls.poll_message_set("Import tracking in step 2 first")
        player = active_player(context.scene.beyond_mocap)
        return player is not None and bool(player.tracking_file)

    def order(self, context):
        """What is to be solved."""
        return tracked.order_of(context.scene)

    @staticmethod
    def work(order, progress, cancelled, hurry):
        """Read and solve."""
        return tracked.work(order, progress, cancelled, hurry)

    def apply(self, scene, solved):
        """The ball, and the list of touches."""
        tracked.write(scene, solved)
        self.report(
            {"INFO"}, f"{len(solved.touches)} touches solved, with {solved.confidence:.0%} confidence in the mean"
        )


class BEYOND_MOCAP_OT_accept_touches(Verb, bpy.types.Operator):
    """Make key moments of the ticked touches, at their solved times. Where a player has a key moment near by already,
none is added"""

    bl_idname = "beyond_mocap.accept_touches"
    bl_label = "Accept Touches"

    active: BoolProperty(
        name="Active Player", default=False, options={"SKIP_SAVE"}, description="Only those of the active player"
    )

    @classmethod
    def poll(cls, context):
        """There are touches."""
        cls.poll_message_set("Press Solve Ball first")
        return len(context.scene.beyond_mocap_passes.touches) > 0

    def do(self, context):
        """Lay the moments."""
        player = active_player(context.scene.beyond_mocap)
        if self.active and player is None:
            raise InputError("player", "none in the list", "one", "import tracking in step 2")
        count, told = tracked.accept(context, player.name if self.active else "")
        if not count and not told:
            raise InputError(
                "touches", "none is ticked that has words and a player of the list", "one", "tick some in the list"
            )
        for line in told[:5]:
            self.report({"INFO"}, line)
        self.report({"INFO"}, f"{count} key moments added")
