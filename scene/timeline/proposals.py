"""Words that were proposed for a clip, on the armature that shows it: looked through one by one, accepted or refused.

Each is listed with how sure it is and why. One that is accepted becomes an ordinary strip or key moment, which can be
changed like any; the list remembers who said it, so that it is written with the words as long as nobody has changed
them.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import bpy
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ...beyond_mocap.annotation import ClipAnnotation, Timeline
from ...beyond_mocap.base.errors import InputError
from ..library.recordings import RATE
from . import lanes, lay_strips

if TYPE_CHECKING:
    from ...beyond_mocap.library.word_sources import Proposal, Sources

SAME = 0.1
"""Seconds within which two key moments are the same one."""

STATES = (("OPEN", "Open", "Nobody has looked at it yet"),
          ("ACCEPTED", "Accepted", "It is among the clip's words"),
          ("REFUSED", "Refused", "It is not what the clip shows"))


def _go(group, context):
    """The playhead goes to the proposal that is chosen."""
    target, one = group.id_data, chosen(group.id_data)
    if one is not None and lanes.written_for(target) is not None:
        seconds = (one.start if one.key < 0 else one.key) / target[RATE]
        context.scene.frame_current = lanes.written_for(target).whole(seconds)


class BeyondMocapProposal(bpy.types.PropertyGroup):
    """One proposal; `name` is its words. Frames are the recording's own."""

    start: IntProperty(name="Start", description="First frame of the row")
    end: IntProperty(name="End", description="Last frame of the row")
    key: IntProperty(name="Key", default=-1, description="Frame of the key moment; -1 where there is none")
    confidence: FloatProperty(name="Sure", min=0.0, max=1.0, subtype="FACTOR", description="How sure it is")
    source: StringProperty(name="Source", description="Who proposes it")
    why: StringProperty(name="Why", description="What was seen")
    state: EnumProperty(name="State", items=STATES, description="What became of it")


class BeyondMocapProposals(bpy.types.PropertyGroup):
    """What was proposed for the clip that an armature shows."""

    attached_to = ("Object.beyond_mocap_proposals",)
    listed: CollectionProperty(type=BeyondMocapProposal, description="By their first frame")
    active: IntProperty(name="Proposal", min=0, update=_go, description="The proposal that is looked at")


def keep(target: bpy.types.Object, found: Iterable["Proposal"], state: str = "OPEN", beside: bool = True) -> None:
    """List proposals in place of those before, the first one chosen. beside: those that were accepted stay listed, as
    their strips stay."""
    group = target.beyond_mocap_proposals
    for index in reversed(range(len(group.listed))):
        if not beside or group.listed[index].state != "ACCEPTED":
            group.listed.remove(index)
    first = len(group.listed)
    for one in found:
        add(target, one.annotation, one.source, confidence=one.confidence, state=state, why=one.why)
    group.active = first if first < len(group.listed) else 0


def add(target: bpy.types.Object, row: ClipAnnotation, source: str, confidence: float, state: str,
        why: str = "") -> None:
    """List one more."""
    one = target.beyond_mocap_proposals.listed.add()
    one.name, one.source, one.why = " ".join(row.words), source, why
    one.start, one.end, one.key = int(row.start), int(row.end), -1 if row.key is None else int(row.key)
    one.confidence, one.state = confidence, state


def said_already(told: Timeline, row: ClipAnnotation, fps: float) -> bool:
    """Whether a timeline has a key moment of the same first word within SAME seconds of a row's key, or a span of the
    same words over half of a row that has none."""
    if row.key is not None:
        return any(key.words[:1] == row.words[:1] and abs(key.time - row.key / fps) <= SAME for key in told.keys)
    start, end = row.start / fps, row.end / fps
    same = (span for span in told.spans if span.words == row.words)
    return any(min(span.end, end) - max(span.start, start) >= 0.5 * (end - start) for span in same)


def chosen(target: bpy.types.Object) -> BeyondMocapProposal | None:
    """The proposal that is looked at; None where nothing is listed."""
    group = target.beyond_mocap_proposals
    return group.listed[group.active] if 0 <= group.active < len(group.listed) else None


def row_of(one: BeyondMocapProposal) -> ClipAnnotation:
    """What a proposal says."""
    return ClipAnnotation(one.start, one.end, None if one.key < 0 else one.key, tuple(one.name.split()))


def accept(target: bpy.types.Object, index: int) -> str:
    """Put a proposal among the clip's words; one that was accepted before stays. A line for the user."""
    from ...beyond_mocap.library.keep_words import as_timeline

    one = _at(target, index)
    if one.state != "ACCEPTED":
        clock, told = lanes.written_for(target), as_timeline([row_of(one)], target[RATE])
        for span in told.spans:
            lay_strips.add_span(target, span, clock)
        for key in told.keys:
            lay_strips.add_moment(target, key, clock)
        one.state = "ACCEPTED"
    return f"{one.name} accepted"


def refuse(target: bpy.types.Object, index: int) -> str:
    """Leave a proposal out; what it had put among the words is taken away again, where nobody has changed it."""
    one = _at(target, index)
    if one.state == "ACCEPTED":
        _take_back(target, row_of(one))
    one.state = "REFUSED"
    return f"{one.name} refused"


def go_on(target: bpy.types.Object, step: int, only_open: bool = False) -> bool:
    """Choose the next proposal (step 1) or the one before (-1), of all or of those that nobody has judged; whether
    there is one. After the last open one the search goes on from the other end."""
    group = target.beyond_mocap_proposals
    count = len(group.listed)
    if only_open:
        order = [(group.active + step * (1 + k)) % count for k in range(count)]
        order = [index for index in order if group.listed[index].state == "OPEN"]
    else:
        order = [index for index in (group.active + step,) if 0 <= index < count]
    if order:
        group.active = order[0]
    return bool(order)


def left(target: bpy.types.Object) -> int:
    """Number of proposals that nobody has judged."""
    return sum(one.state == "OPEN" for one in target.beyond_mocap_proposals.listed)


def sources(target: bpy.types.Object) -> "Sources":
    """Who said the accepted rows."""
    listed = target.beyond_mocap_proposals.listed
    return {row_of(one): (one.source, one.confidence) for one in listed if one.state == "ACCEPTED"}


def _at(target: bpy.types.Object, index: int) -> BeyondMocapProposal:
    listed = target.beyond_mocap_proposals.listed
    if not 0 <= index < len(listed):
        raise InputError(target.name, f"no proposal {index}", "one of the list", "press Look Through")
    return listed[index]


def _take_back(target: bpy.types.Object, row: ClipAnnotation) -> None:
    fps = target[RATE]
    if row.key is not None:
        for placed in lanes.moments(target):
            if placed.words == row.words and abs(placed.time - row.key / fps) < 0.5 / fps:
                lay_strips.remove_moment(target, placed.strip, placed.index)
                break
    for placed in lanes.spans(target):
        span = placed.span
        if span.words == row.words and abs(span.start - row.start / fps) < 0.5 / fps:
            lay_strips.remove_span(target, placed.strip)
            break
