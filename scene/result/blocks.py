"""A take's pieces of clips: noted on its action, cut into NLA strips, and strips made one action again.

A strip plays an action of its own that holds the keys of its piece, and one key more on either side where there is
one, so that whatever curve leads through a seam is the same in both: playing the strips gives the pose that the one
action gives, at every fraction of a frame.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.synthesis.take import Take
from ..core import channels
from ..core.action import PLACED
from ..core.measure import frames_per_second
from ..core.set_aside import purge_action
from . import bake, hand_keys
from .bake import MARK

TRACK = "Beyond Mocap"
BLOCKS = "beyond_mocap_blocks"  # on an action: its pieces as JSON


@dataclass(frozen=True)
class Block:
    """A piece of one clip: from scene frame `start` to `end`, and what is shown."""

    start: int
    end: int
    name: str


def note(action: bpy.types.Action, take: Take, scene: bpy.types.Scene) -> None:
    """Write onto an action which clips its frames show."""
    action[BLOCKS] = json.dumps([[block.start, block.end, block.name] for block in blocks_of(take, scene)])


def noted(action: bpy.types.Action) -> tuple[Block, ...]:
    """The pieces that an action notes; none where it notes nothing."""
    return tuple(Block(*row) for row in json.loads(action.get(BLOCKS, "[]")))


def blocks_of(take: Take, scene: bpy.types.Scene) -> tuple[Block, ...]:
    """The pieces of a take in scene frames, seams on the nearest whole frame; shorter ones are left out."""
    seams = [0, *(int(seam) for seam in take.seams), len(take.motion)]
    rate = frames_per_second(scene) / take.motion.fps
    first = bake.frame_at(scene, take.start_time)
    edges = [int(round(first + seam * rate)) for seam in seams]
    edges[0], edges[-1] = int(np.ceil(first - 1e-4)), int(np.floor(first + (len(take.motion) - 1) * rate + 1e-4))
    found = []
    for seam, start, end in zip(seams, edges, edges[1:]):
        if end > start:
            found.append(Block(found[-1].end if found else start, end, name_of(take, seam)))
    return tuple(found)


def name_of(take: Take, frame: int) -> str:
    """What a strip that begins at a frame of the take is called: clip, and words."""
    clip = take.clips[take.clip[frame]].rpartition("/")[2].removesuffix(".bvh")
    mirrored = " (mirrored)" if take.mirrored[frame] else ""
    return f"{clip}{mirrored} {' '.join(take.words[frame])}".strip()[:60]


def as_strips(body: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.NlaTrack:
    """Cut the action that `body` plays into strips on its track of ours; the action goes. Returns the track."""
    whole, slot = channels.playing(body)
    track = track_of(body)
    if whole is None:
        return track
    _clear(track)
    data = body.animation_data
    pieces = noted(whole) or (Block(*channels.keyed_range(channels.curves(whole, slot)), whole.name),)
    if track is None:
        track = data.nla_tracks.new()
        track.name = TRACK
    data.action, made = None, hand_keys.read(whole)
    for number, block in enumerate(pieces):
        action, part = channels.cut(whole, slot, block.start, block.end, block.name)
        if made is not None:
            hand_keys.write(action, made.part(block.start, block.end))
        action[MARK], action[BLOCKS] = True, json.dumps([[block.start, block.end, block.name]])
        _keep_place(whole, action)
        strip = track.strips.new(block.name, block.start, action)
        strip.action_slot = part
        strip.use_sync_length = False
        strip.action_frame_start, strip.action_frame_end = block.start, block.end
        strip.frame_start, strip.frame_end = block.start, block.end
        strip.blend_type = "REPLACE"
        strip.extrapolation = "HOLD" if number == 0 else "HOLD_FORWARD"
        strip.name = block.name
    data.use_nla = True
    if not whole.users - whole.use_fake_user:
        purge_action(whole, MARK)
    return track


def as_action(body: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Action | None:
    """Let `body` play one action: the one that it plays, or its strips of ours put together; the strips go."""
    whole, _ = channels.playing(body)
    track = track_of(body)
    if track is None:
        return whole
    if whole is None:
        alone = {strip.action: strip.action_slot for strip in track.strips}  # one that was split shows its action twice
        parts = [(action, slot, *noted(action)[0:1]) for action, slot in alone.items()]
        pieces = [(action, slot, block.start, block.end) for action, slot, block in parts]
        whole, slot = channels.joined(pieces, f"{body.name} take", body.name)
        channels.assign(body, whole, slot)
        made = hand_keys.joined([hand_keys.read(action) for action, _, _ in parts])
        if made is not None:
            hand_keys.write(whole, made)
        whole[MARK] = True
        _keep_place(parts[0][0], whole)
        whole[BLOCKS] = json.dumps([[block.start, block.end, block.name] for _, _, block in parts])
    _clear(track)
    body.animation_data.nla_tracks.remove(track)
    return whole


def _keep_place(source: bpy.types.Action, made: bpy.types.Action) -> None:
    """Note on a made action where the body stood when the motion was written."""
    if PLACED in source:
        made[PLACED] = list(source[PLACED])


def track_of(body: bpy.types.Object) -> bpy.types.NlaTrack | None:
    """The NLA track of `body` that holds our strips; None where there is none."""
    tracks = body.animation_data.nla_tracks if body.animation_data is not None else ()
    return next((track for track in tracks if track.strips and all(
        strip.action is not None and strip.action.get(MARK) for strip in track.strips)), None)


def _clear(track: bpy.types.NlaTrack | None) -> None:
    """Remove the strips of a track, and their actions."""
    for strip in list(track.strips) if track is not None else ():
        action = strip.action
        track.strips.remove(strip)
        if action is not None:
            purge_action(action, MARK)
