"""What the verbs of the timeline share: whose strips they work on, and which key moment or spans are meant."""

from __future__ import annotations

import bpy

from ..beyond_mocap.errors import InputError
from ..scene import lanes, word_checks
from ..scene.subject import can_have, clock, name_of, subject
from .verb import Verb


class TimelineVerb(Verb):
    """A verb for the active player's timeline, or for that of a library clip that is being annotated."""

    @classmethod
    def poll(cls, context):
        """There is somebody with strips."""
        cls.poll_message_set("Import tracking in step 2 first, and bring its players to the timeline")
        return subject(context) is not None

    def attempt(self, action):
        """As ever; the lines about words are worked out anew."""
        done = super().attempt(action)
        word_checks.keep(bpy.context)
        return done


class WritingVerb(TimelineVerb):
    """A verb that brings the timeline about where there is none yet."""

    @classmethod
    def poll(cls, context):
        """There is a player."""
        cls.poll_message_set("Import tracking in step 2 first")
        return can_have(context)


class MomentVerb(TimelineVerb):
    """A verb for the picked key moment."""

    @classmethod
    def poll(cls, context):
        """A key moment is picked."""
        if not super().poll(context):
            return False
        cls.poll_message_set("Pick a key moment first: click its name in the NLA editor or in the list")
        return is_picked(subject(context))


def is_picked(target: bpy.types.Object) -> bool:
    """Whether a key moment is picked, found without reading any words."""
    return any(marker.select for _, strip in lanes.strips(target) for marker in strip.action.pose_markers)


def picked(target: bpy.types.Object) -> lanes.PlacedMoment:
    """The picked key moment; InputError where there is none."""
    found = next((moment for moment in lanes.moments(target) if moment.selected), None)
    if found is None:
        raise InputError(name_of(target), "no key moment is picked", "one", "click its name in the NLA editor")
    return found


def selected_spans(target: bpy.types.Object) -> list[lanes.PlacedSpan]:
    """The spans whose strips are selected, by start."""
    return [span for span in lanes.spans(target) if span.selected]


def playhead(context: bpy.types.Context, target: bpy.types.Object) -> float:
    """The playhead, in seconds on the clock of the object's strips."""
    return clock(context, target).seconds(context.scene.frame_current_final)
