"""Bake: put the takes of all chosen players, and the ball, into the scene."""

from __future__ import annotations

import bpy

from ..beyond_mocap.errors import InputError
from ..scene import bake, plans, session
from .verb import Verb


class BEYOND_MOCAP_OT_bake(Verb, bpy.types.Operator):
    """Put the synthesized motions onto armatures, with bodies, the ball and the tracks, at the scene's frame rate"""

    bl_idname = "beyond_mocap.bake"
    bl_label = "Bake"

    @classmethod
    def poll(cls, context):
        """There is something to bake."""
        cls.poll_message_set("Synthesize first")
        return any(player.use and player.take for player in context.scene.beyond_mocap.players)

    def do(self, context):
        """All takes, then the ball and the camera."""
        settings = context.scene.beyond_mocap
        chosen = [(player, session.made(player.take)) for player in plans.chosen(settings) if player.take]
        lost = [player.name for player, made in chosen if made is None]
        if lost or not chosen:
            found = f"no take of {', '.join(lost) or 'any player'} in this session"
            raise InputError("bake", found, "", "synthesize again")
        bodies = [bake.player(context, player, made) for player, made in chosen]
        takes = [made.take for _, made in chosen]
        ball = bake.ball_of(takes, settings)
        if ball is not None:
            bake.the_ball(context, ball)
        bake.camera(context.scene, takes)
        context.view_layer.objects.active = bodies[-1]
        self.report({"INFO"}, f"players baked: {len(bodies)}{', and the ball' if ball else ''}")
