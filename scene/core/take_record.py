"""What a bake and an export need of a take, stored on the actions that play it: contacts of the feet, and its rate.

Actions are saved with the file, takes of the session are not: what is read from the action is the same after the file
is opened again.
"""

from __future__ import annotations

import json

import bpy
import numpy as np

from ...beyond_mocap.base.time_series import find_runs
from . import channels

CONTACTS = "beyond_mocap_contacts"  # on an action: JSON with the frames in which each foot is in contact
RATE = "beyond_mocap_rate"  # on an action: frames per second of its take
FEET = ("left", "right")


def store_contacts(action: bpy.types.Action, frames: np.ndarray, contacts: np.ndarray) -> None:
    """Store contacts (F, 2) bool of left and right foot, at whole scene frames (F,), on an action."""
    frames = np.asarray(frames, int)
    runs = {foot: [[int(frames[start]), int(frames[end - 1])] for start, end in find_runs(contacts[:, side])]
            for side, foot in enumerate(FEET)}
    action[CONTACTS] = json.dumps(runs)


def read_contacts(action: bpy.types.Action | None, frames: np.ndarray) -> np.ndarray | None:
    """Read the contacts (F, 2) bool stored on an action at its frames (F,), rounded; None if it has none."""
    if action is None or CONTACTS not in action:
        return None
    runs, at = json.loads(action[CONTACTS]), np.round(frames)
    found = np.zeros((len(at), 2), bool)
    for side, foot in enumerate(FEET):
        for start, end in runs[foot]:
            found[:, side] |= (at >= start) & (at <= end)
    return found


def read_body_contacts(body: bpy.types.Object, frames: np.ndarray) -> np.ndarray | None:
    """Read the contacts (F, 2) bool of what an armature plays at scene frames (F,); None where nothing is stored.

    Strips are read at their place and playback rate.
    """
    whole = read_contacts(channels.find_playing_action(body)[0], frames)
    if whole is not None:
        return whole
    found = None
    for strip in list_strips(body):
        at = strip.action_frame_start + (frames - strip.frame_start) / strip.scale
        stored = read_contacts(strip.action, at)
        if stored is not None:
            inside = (frames >= strip.frame_start) & (frames <= strip.frame_end)
            found = stored & inside[:, None] if found is None else np.where(inside[:, None], stored, found)
    return found


def read_rate(body: bpy.types.Object) -> float | None:
    """Read the rate of the take that an armature plays, frames per second; None where it is not stored."""
    playing = channels.find_playing_action(body)[0]
    actions = [playing, *(strip.action for strip in list_strips(body))]
    return next((float(one[RATE]) for one in actions if one is not None and RATE in one), None)


def copy_record(source: bpy.types.Action, target: bpy.types.Action) -> None:
    """Copy what is stored of a take to another action with the same frames."""
    for name in (CONTACTS, RATE):
        if name in source:
            target[name] = source[name]


def list_strips(body: bpy.types.Object) -> list[bpy.types.NlaStrip]:
    """List the strips that an armature plays, from the lowest track up."""
    data = body.animation_data
    return [strip for track in (data.nla_tracks if data is not None and data.use_nla else ()) if not track.mute
            for strip in track.strips if not strip.mute]
