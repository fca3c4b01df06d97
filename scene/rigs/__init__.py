"""Rigs of any kind: what their controls do, and motions baked onto them.

- `armature`       skeletons as armatures, and back; a rig copied with its children
- `control_study`  a rig posed temporarily; the carrier of each control, found by random rotations
- `controls`       world poses as values of the controls' channels; constraints that would override them
- `driven`         a rig's driven bones as a skeleton of the core; the IK targets, poles and helpers of each part
- `fit`            the motion that an armature plays, and the same on the driven skeleton, feet planted
- `bone_curves`    poses of driven bones and an exported root at each frame, and the curves of bones' channels
- `rig_bake`       a motion baked onto a rig; the rig's previous state, and whether its keys are unchanged
"""

REGISTERED = ("rig",)
