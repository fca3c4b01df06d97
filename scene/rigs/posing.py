"""A rig posed by hand for a while: without its animation, and as it was afterwards."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import bpy
import numpy as np

CHANNELS = ("location", "rotation_quaternion", "rotation_euler", "rotation_axis_angle", "scale")


class PosedRig:
    """Some controls of a rig, posed by hand.

        with PosedRig(rig, layer, controls) as posed:
            matrices = posed.pose(turns, bones)

    controls: the bones that are posed. layer: the view layer whose depsgraph poses the rig. silent: constraints that
    are muted meanwhile.
    """

    def __init__(
        self, rig: bpy.types.Object, layer: bpy.types.ViewLayer, controls: Sequence[str],
        silent: Iterable[bpy.types.Constraint] = (),
    ):  # fmt: skip
        self.rig, self.layer, self.controls = rig, layer, list(controls)
        self._muted = [(constraint, constraint.mute) for constraint in silent]

    def pose(self, turns: np.ndarray, bones: Sequence[str], places: np.ndarray | None = None) -> np.ndarray:
        """Pose the controls, and read bones as Blender then poses them.

        turns: (n, 4), the controls' own rotations. places: (n, 3), their locations, at rest where None.
        Returns (W, 4, 4), the bones' poses in the armature's space.
        """
        for number, (name, turn) in enumerate(zip(self.controls, turns)):
            bone = self.rig.pose.bones[name]
            bone.rotation_quaternion = turn
            bone.location = (0.0, 0.0, 0.0) if places is None else places[number]
        _update(self.rig, self.layer)
        shown = self.rig.evaluated_get(self.layer.depsgraph)
        return np.array([shown.pose.bones[name].matrix for name in bones])

    def __enter__(self) -> PosedRig:
        self._remember()
        try:
            self._silence()
        except BaseException:
            self._restore()
            raise
        return self

    def __exit__(self, *_) -> None:
        self._restore()

    def _remember(self) -> None:
        data, bones = self.rig.animation_data, self.rig.pose.bones
        self._playing = (data.use_nla, data.action, data.action_slot) if data else None
        self._position = self.rig.data.pose_position
        self._modes = {name: bones[name].rotation_mode for name in self.controls}
        self._values = {
            (name, channel): tuple(getattr(bones[name], channel)) for name in self.controls for channel in CHANNELS
        }

    def _silence(self) -> None:
        if self._playing is not None:
            self.rig.animation_data.action = None
            self.rig.animation_data.use_nla = False
        if self._position != "POSE":
            self.rig.data.pose_position = "POSE"
        for constraint, _ in self._muted:
            constraint.mute = True
        for name in self.controls:
            bone = self.rig.pose.bones[name]
            bone.location, bone.scale, bone.rotation_mode = (0, 0, 0), (1, 1, 1), "QUATERNION"

    def _restore(self) -> None:
        for constraint, mute in self._muted:
            constraint.mute = mute
        for name, mode in self._modes.items():
            self.rig.pose.bones[name].rotation_mode = mode
        for (name, channel), value in self._values.items():
            setattr(self.rig.pose.bones[name], channel, value)
        if self._position != self.rig.data.pose_position:
            self.rig.data.pose_position = self._position
        if self._playing is not None:
            data = self.rig.animation_data
            data.use_nla, data.action, slot = self._playing
            if data.action is not None and slot is not None:
                data.action_slot = slot
        _update(self.rig, bpy.context.view_layer)


def _update(rig: bpy.types.Object, layer: bpy.types.ViewLayer) -> None:
    rig.update_tag(refresh={"OBJECT", "DATA", "TIME"})
    layer.update()
