"""Rigs of any make: what their controls do, and a motion laid down on them.

- `armature`       skeletons as armatures, and back; a rig copied with all that hangs on it
- `control_study`  a rig posed by hand for a while; on what each control rides, found by turning the controls by chance
- `controls`       a pose asked for in the world as values of the controls' channels; what would hold them against that
- `driven`         a rig's driven bones as a skeleton of the core; the IK targets, poles and helpers that go with a part
- `fit`            the motion that an armature plays, and it on the driven skeleton, feet planted
- `bone_curves`    where driven bones and an exported root have to be at each frame, and the curves of bones' channels
- `rig_bake`       a motion laid down on a rig; how the rig was before, and whether its keys are still the baked ones
"""
