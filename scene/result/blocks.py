"""A take's pieces of clips: noted on its action, cut into NLA strips, and strips joined to one action again.

A strip plays an action of its own with the keys of its piece, and one more key on either side if there is one, so that
a curve through a transition is the same in both: playing the strips gives the pose of the single action at every
fraction of a frame.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.annotation import DISCRETE
from ...beyond_mocap.synthesis.take import Take
from ..core import channels, take_record
from ..core.action import PLACEMENT
from ..core.measure import frames_per_second
from ..core.saved_state import remove_unused_action
from . import bake
from . import manual_keys as hand_keys
from .bake import MARK

TRACK = "Beyond Mocap"
BLOCKS = "beyond_mocap_blocks"  # on an action: its pieces as JSON


@dataclass(frozen=True)
class Block:
    """A piece of one clip, from scene frame `start` to `end`, with its name."""

    start: int
    end: int
    name: str


def store_blocks(action: bpy.types.Action, take: Take, scene: bpy.types.Scene) -> None:
    """Store on an action which clips its frames show."""
    action[BLOCKS] = json.dumps([[block.start, block.end, block.name] for block in compute_blocks(take, scene)])


def read_blocks(action: bpy.types.Action) -> tuple[Block, ...]:
    """Read the pieces stored on an action; none if it has none."""
    return tuple(Block(*row) for row in json.loads(action.get(BLOCKS, "[]")))


def compute_blocks(take: Take, scene: bpy.types.Scene) -> tuple[Block, ...]:
    """Compute the pieces of a take in scene frames, with transitions on the nearest whole frame; shorter ones are
    left out.
    """
    transitions = [0, *(int(seam) for seam in take.seams), len(take.motion)]
    rate = frames_per_second(scene) / take.motion.fps
    first = bake.compute_frame(scene, take.start_time)
    edges = [int(round(first + seam * rate)) for seam in transitions]
    edges[0], edges[-1] = int(np.ceil(first - 1e-4)), int(np.floor(first + (len(take.motion) - 1) * rate + 1e-4))
    found = []
    for seam, until, start, end in zip(transitions, transitions[1:], edges, edges[1:]):
        if end > start:
            found.append(Block(found[-1].end if found else start, end, build_strip_name(take, seam, until)))
    return tuple(found)


def build_strip_name(take: Take, first: int, end: int) -> str:
    """Build the name of the strip of the frames `first` to before `end` of a take: clip and labels.

    The labels are those of its action if there is one: a kick on the run begins with a run-up.
    """
    frame = next((i for i in range(first, end) if DISCRETE.intersection(take.words[i])), first)
    clip = take.clips[take.clip[frame]].rpartition("/")[2].removesuffix(".bvh")
    mirrored = " (mirrored)" if take.mirrored[frame] else ""
    return f"{clip}{mirrored} {' '.join(take.words[frame])}".strip()[:60]


def convert_to_strips(body: bpy.types.Object) -> bpy.types.NlaTrack:
    """Cut the action of `body` into strips on a track of the extension; the action is removed. Returns the track."""
    whole, slot = channels.find_playing_action(body)
    track = find_track(body)
    if whole is None:
        return track
    _clear_track(track)
    data = body.animation_data
    pieces = read_blocks(whole) or (Block(*channels.find_key_range(channels.collect_curves(whole, slot)), whole.name),)
    if track is None:
        track = data.nla_tracks.new()
        track.name = TRACK
    data.action, generated = None, hand_keys.read_generated(whole)
    for number, block in enumerate(pieces):
        action, part = channels.cut_action(whole, slot, block.start, block.end, block.name)
        if generated is not None:
            hand_keys.write_generated(action, generated.select_frames(block.start, block.end))
        action[MARK], action[BLOCKS] = True, json.dumps([[block.start, block.end, block.name]])
        _copy_record(whole, action)
        strip = add_strip(track, action, part, block.start, last=block.end, name=block.name)
        strip.extrapolation = "HOLD" if number == 0 else "HOLD_FORWARD"
    data.use_nla = True
    if not whole.users - whole.use_fake_user:
        remove_unused_action(whole, MARK)
    return track


def add_strip(track: bpy.types.NlaTrack, action: bpy.types.Action, slot, first: int, last: int,
              name: str) -> bpy.types.NlaStrip:
    """Add a strip that plays the frames `first` to `last` of an action where they are."""
    strip = track.strips.new(name, first, action)
    strip.action_slot = slot
    strip.use_sync_length = False
    strip.action_frame_start, strip.action_frame_end = first, last
    strip.frame_start, strip.frame_end = first, last
    strip.blend_type = "REPLACE"
    strip.name = name
    return strip


def convert_to_action(body: bpy.types.Object) -> bpy.types.Action | None:
    """Join the strips of `body` to one action, if it does not play one already; the strips are removed."""
    whole, _ = channels.find_playing_action(body)
    track = find_track(body)
    if track is None:
        return whole
    if whole is None:
        slots_by_action = {strip.action: strip.action_slot for strip in track.strips}  # split strips share one action
        parts = [(action, slot, *read_blocks(action)[0:1]) for action, slot in slots_by_action.items()]
        pieces = [(action, slot, block.start, block.end) for action, slot, block in parts]
        whole, slot = channels.join_actions(pieces, f"{body.name} take", body.name)
        channels.assign_action(body, whole, slot)
        generated = hand_keys.join_generated([hand_keys.read_generated(action) for action, _, _ in parts])
        if generated is not None:
            hand_keys.write_generated(whole, generated)
        whole[MARK] = True
        _copy_record(parts[0][0], whole)
        whole[BLOCKS] = json.dumps([[block.start, block.end, block.name] for _, _, block in parts])
    _clear_track(track)
    body.animation_data.nla_tracks.remove(track)
    return whole


def _copy_record(source: bpy.types.Action, target: bpy.types.Action) -> None:
    """Copy the stored place of the body, and what is stored of the take, to another action."""
    if PLACEMENT in source:
        target[PLACEMENT] = list(source[PLACEMENT])
    take_record.copy_record(source, target)


def find_track(body: bpy.types.Object) -> bpy.types.NlaTrack | None:
    """Find the NLA track of `body` with strips of the extension; None without one."""
    tracks = body.animation_data.nla_tracks if body.animation_data is not None else ()
    return next((track for track in tracks if track.strips and all(
        strip.action is not None and strip.action.get(MARK) for strip in track.strips)), None)


def _clear_track(track: bpy.types.NlaTrack | None) -> None:
    """Remove the strips of a track, and their actions."""
    for strip in list(track.strips) if track is not None else ():
        action = strip.action
        track.strips.remove(strip)
        if action is not None:
            remove_unused_action(action, MARK)
