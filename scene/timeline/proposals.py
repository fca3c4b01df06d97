"""Proposed labels for a clip, on the armature that shows it: reviewed one by one, accepted or rejected.

Each is listed with its confidence and reason. An accepted proposal becomes an ordinary strip or key moment; the list
stores its source, which is written with the labels while they stay unchanged.
"""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import bpy
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ...beyond_mocap import annotation
from ...beyond_mocap.base.errors import InputError
from ..library import recordings
from . import label_tracks as lanes
from . import strip_writing as lay_strips

if TYPE_CHECKING:
    from ...beyond_mocap.library.folder.label_sources import Proposal, Sources

SAME_SECONDS = 0.1
"""Seconds within which two key moments are the same one."""

STATES = (("OPEN", "Open", "Not reviewed yet"),
          ("ACCEPTED", "Accepted", "Among the clip's labels"),
          ("REFUSED", "Rejected", "Not what the clip shows"))


def _go_to_proposal(group, context):
    """Move the playhead to the active proposal."""
    target, one = group.id_data, find_active(group.id_data)
    if one is not None and lanes.read_clock(target) is not None:
        seconds = (one.start if one.key < 0 else one.key) / target[recordings.RATE]
        context.scene.frame_current = lanes.read_clock(target).to_whole_frame(seconds)


class BeyondMocapProposal(bpy.types.PropertyGroup):
    """One proposal; `name` is its labels. Frames are the recording's own."""

    start: IntProperty(name="Start", description="First frame of the proposal")
    end: IntProperty(name="End", description="Last frame of the proposal")
    key: IntProperty(name="Key", default=-1, description="Frame of the key moment; -1 without one")
    confidence: FloatProperty(name="Confidence", min=0.0, max=1.0, subtype="FACTOR", description="Confidence of the "
                              "proposal")
    source: StringProperty(name="Source", description="Method or person that proposes it")
    why: StringProperty(name="Reason", description="Evidence for the proposal")
    state: EnumProperty(name="State", items=STATES, description="State of the review")


class BeyondMocapProposals(bpy.types.PropertyGroup):
    """The proposals for the clip that an armature shows."""

    attached_to = ("Object.beyond_mocap_proposals",)
    listed: CollectionProperty(type=BeyondMocapProposal, description="Proposals by their first frame")
    active: IntProperty(name="Proposal", min=0, update=_go_to_proposal, description="The proposal under review")


def store_proposals(target: bpy.types.Object, found: "Iterable[Proposal]", state: str = "OPEN",
                    keep_accepted: bool = True) -> None:
    """List proposals in place of the previous ones, and activate the first.

    Args:
        target: the armature.
        found: the proposals.
        state: of all of them.
        keep_accepted: keep accepted ones in the list, as their strips stay.
    """
    group = target.beyond_mocap_proposals
    for index in reversed(range(len(group.listed))):
        if not keep_accepted or group.listed[index].state != "ACCEPTED":
            group.listed.remove(index)
    first = len(group.listed)
    for one in found:
        add_proposal(target, one.annotation, one.source, confidence=one.confidence, state=state, why=one.why)
    group.active = first if first < len(group.listed) else 0


def add_proposal(target: bpy.types.Object, row: "annotation.ClipAnnotation", source: str, confidence: float, state: str,
                 why: str = "") -> None:
    """Add one proposal to the list."""
    one = target.beyond_mocap_proposals.listed.add()
    one.name, one.source, one.why = " ".join(row.words), source, why
    one.start, one.end, one.key = int(row.start), int(row.end), -1 if row.key is None else int(row.key)
    one.confidence, one.state = confidence, state


def has_labels(timeline: "annotation.Timeline", row: "annotation.ClipAnnotation", fps: float) -> bool:
    """Return whether a timeline already has the labels of a row.

    That is a key moment with the same first label within SAME_SECONDS seconds of the row's key, or a span with the same
    labels over half of a row without a key.
    """
    if row.key is not None:
        return any(key.words[:1] == row.words[:1] and abs(key.time - row.key / fps) <= SAME_SECONDS
                   for key in timeline.keys)
    start, end = row.start / fps, row.end / fps
    equal_spans = (span for span in timeline.spans if span.words == row.words)
    return any(min(span.end, end) - max(span.start, start) >= 0.5 * (end - start) for span in equal_spans)


def find_active(target: bpy.types.Object) -> BeyondMocapProposal | None:
    """Find the active proposal; None if the list is empty."""
    group = target.beyond_mocap_proposals
    return group.listed[group.active] if 0 <= group.active < len(group.listed) else None


def to_row(one: BeyondMocapProposal) -> "annotation.ClipAnnotation":
    """Convert a proposal to a row of annotation."""
    return annotation.ClipAnnotation(one.start, one.end, None if one.key < 0 else one.key, tuple(one.name.split()))


def accept_proposal(target: bpy.types.Object, index: int) -> str:
    """Add a proposal to the clip's labels, unless it was accepted before. Returns a line for the user."""
    from ...beyond_mocap.library.folder.label_files import to_timeline

    one = _find_proposal(target, index)
    if one.state != "ACCEPTED":
        clock, timeline = lanes.read_clock(target), to_timeline([to_row(one)], target[recordings.RATE])
        for span in timeline.spans:
            lay_strips.add_span(target, span, clock)
        for key in timeline.keys:
            lay_strips.add_moment(target, key, clock)
        one.state = "ACCEPTED"
    return f"{one.name} accepted"


def reject_proposal(target: bpy.types.Object, index: int) -> str:
    """Reject a proposal; labels that it had added are removed if they are unchanged. Returns a line for the user."""
    one = _find_proposal(target, index)
    if one.state == "ACCEPTED":
        _remove_labels(target, to_row(one))
    one.state = "REFUSED"
    return f"{one.name} rejected"


def go_to_next(target: bpy.types.Object, step: int, open_only: bool = False) -> bool:
    """Activate the next (step 1) or previous (-1) proposal, of all or of open ones; returns whether there is one.

    After the last open one the search continues from the other end.
    """
    group = target.beyond_mocap_proposals
    count = len(group.listed)
    if open_only:
        order = [(group.active + step * (1 + k)) % count for k in range(count)]
        order = [index for index in order if group.listed[index].state == "OPEN"]
    else:
        order = [index for index in (group.active + step,) if 0 <= index < count]
    if order:
        group.active = order[0]
    return bool(order)


def count_open(target: bpy.types.Object) -> int:
    """Count the proposals that are still open."""
    return sum(one.state == "OPEN" for one in target.beyond_mocap_proposals.listed)


def collect_sources(target: bpy.types.Object) -> "Sources":
    """Collect the sources of the accepted rows."""
    listed = target.beyond_mocap_proposals.listed
    return {to_row(one): (one.source, one.confidence) for one in listed if one.state == "ACCEPTED"}


def _find_proposal(target: bpy.types.Object, index: int) -> BeyondMocapProposal:
    listed = target.beyond_mocap_proposals.listed
    if not 0 <= index < len(listed):
        raise InputError(target.name, f"has no proposal {index}", "one of the list", "press Review")
    return listed[index]


def _remove_labels(target: bpy.types.Object, row: "annotation.ClipAnnotation") -> None:
    """Remove the strips and markers with the labels and times of a row."""
    fps = target[recordings.RATE]
    if row.key is not None:
        for placed in lanes.list_moments(target):
            if placed.labels == row.words and abs(placed.time - row.key / fps) < 0.5 / fps:
                lay_strips.remove_moment(target, placed.strip, placed.index)
                break
    for placed in lanes.list_spans(target):
        span = placed.span
        if span.words == row.words and abs(span.start - row.start / fps) < 0.5 / fps:
            lay_strips.remove_span(target, placed.strip)
            break
