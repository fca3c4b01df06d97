"""Rigs of any make: what their controls do, and a motion laid down on them.

- `posing`         a rig posed by hand for a while, without its animation
- `control_study`  on what each control rides, found by turning the controls by chance
- `controls`       a pose asked for in the world as values of the controls' channels; what would hold them against that
- `followers`      the IK targets, poles and helper bones that go with a part of the body
- `driven`         a rig's driven bones as a skeleton of the core
- `source`         the motion that an armature plays
- `fit`            a motion on the driven skeleton, feet planted
- `bone_curves`    where the driven bones have to be at each frame, and the curves of their channels
- `bake_record`    how a rig was before a bake, and whether its keys are still the baked ones
"""
