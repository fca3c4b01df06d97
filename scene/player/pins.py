"""Pins in the scene: an Empty for each place where a hand, a foot, the gaze or the ball has to be, with its time."""

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, PointerProperty

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import humanoid
from ...beyond_mocap.synthesis import pin as core_pin
from ..core import window
from ..core.measure import build_scene_clock, units_per_metre
from ..rigs import armature

PARTS = (("left_hand", "Left Hand", "Pin the wrist of the left hand", "VIEW_PAN", 0),
         ("right_hand", "Right Hand", "Pin the wrist of the right hand", "VIEW_PAN", 1),
         ("left_foot", "Left Foot", "Pin the ankle of the left foot", "MOD_DYNAMICPAINT", 2),
         ("right_foot", "Right Foot", "Pin the ankle of the right foot", "MOD_DYNAMICPAINT", 3),
         ("gaze", "Gaze", "Pin the point that the player looks at", "HIDE_OFF", 4),
         ("ball", "Ball", "Pin the ball at the nearest key moment at which the player meets it", "MESH_UVSPHERE", 5))
SIZE = 0.12  # metres, just larger than the ball
GAZE_DISTANCE = 3.0  # metres in front of the head at which a new gaze pin is placed


class BeyondMocapPin(bpy.types.PropertyGroup):
    """One pin of a player; its name is the part's"""

    target: PointerProperty(name="Place", type=bpy.types.Object,
                            description="The Empty that marks the position; move it with G")
    part: EnumProperty(name="Part", items=PARTS, description="Part of the body that is pinned")
    time: FloatProperty(name="Time", unit="TIME_ABSOLUTE", precision=2,
                        description="Time on the track's clock at which the part is there")
    hold: FloatProperty(name="Hold", min=0.0, soft_max=5.0, unit="TIME_ABSOLUTE", precision=2,
                        description="Duration for which the part stays there; 0 for a moment, as always for the ball")


def read_pins(scene: bpy.types.Scene, player) -> "tuple[core_pin.Pin, ...]":
    """Read a player's pins whose Empties are in the scene."""
    metres = 1.0 / units_per_metre(scene)
    found = []
    for pin in player.pins:
        if pin.target is not None and pin.target.name in scene.objects:
            place = np.array(pin.target.matrix_world.translation, dtype=float) * metres
            hold = 0.0 if pin.part == core_pin.BALL else round(pin.hold, 6)
            found.append(core_pin.Pin(round(pin.time, 6), pin.part, tuple(np.round(place, 6)), hold))
    return tuple(found)


def add_pin(context: bpy.types.Context, player, part: str, seconds: float, hold: float, place,
            collection) -> bpy.types.Object:
    """Add a pin at `place` (3,) metres, world; returns its Empty, which is selected and active."""
    units = units_per_metre(context.scene)
    target = bpy.data.objects.new(f"{player.name} {part.replace('_', ' ')}", None)
    target.empty_display_type = "SINGLE_ARROW" if part == "gaze" else "SPHERE"
    target.empty_display_size, target.show_name = SIZE * units, True
    target.color = (*player.shirt, 1.0)
    target.location = np.asarray(place) * units
    collection.objects.link(target)
    pin = player.pins.add()
    pin.name, pin.target, pin.part, pin.time, pin.hold = target.name, target, part, seconds, hold
    player.active_pin = len(player.pins) - 1
    context.view_layer.update()
    if target.name in context.view_layer.objects:  # otherwise its collection is excluded
        window.select_only(context, target)
    return target


def remove_pin(player, number: int) -> None:
    """Remove a pin and its Empty from the file."""
    target = player.pins[number].target
    player.pins.remove(number)
    player.active_pin = max(0, min(player.active_pin, len(player.pins) - 1))
    if target is not None:
        bpy.data.objects.remove(target)


def remove_all_pins(player) -> None:
    """Remove all of a player's pins from the file."""
    for number in reversed(range(len(player.pins))):
        remove_pin(player, number)


def find_part_position(context: bpy.types.Context, player, part: str) -> np.ndarray:
    """Find the world position (3,) in metres of the player's part on the current frame, or GAZE_DISTANCE in front of
    the face.
    """
    if player.body is None:
        raise InputError(f"player {player.name}", "no body", "a body to pin",
                         "Synthesize first, or pin at the 3D cursor")
    skeleton = armature.build_skeleton(player.body, context.scene)
    body = humanoid.identify_joints(skeleton)
    sides = {"left": body.left, "right": body.right}
    side, _, what = part.partition("_")
    joint = body.head if part == "gaze" else getattr(sides[side], what)
    if joint is None:
        raise InputError(f"armature {player.body.name}", f"no bone for {part}", "a humanoid", "choose another part")
    shown = player.body.evaluated_get(context.evaluated_depsgraph_get())
    units = units_per_metre(context.scene)

    def find_bone_position(number: int) -> np.ndarray:
        return np.array(shown.matrix_world @ shown.pose.bones[skeleton.names[number]].head) / units

    if part != "gaze":
        return find_bone_position(joint)
    across = find_bone_position(body.left.upper_leg) - find_bone_position(body.right.upper_leg)
    ahead = np.array([across[1], -across[0], 0.0])
    return find_bone_position(joint) + GAZE_DISTANCE * ahead / max(np.linalg.norm(ahead), 1e-9)


def find_current_second(scene: bpy.types.Scene) -> float:
    """Return the track's time in seconds on the scene's current frame."""
    return build_scene_clock(scene).to_seconds(scene.frame_current_final)
