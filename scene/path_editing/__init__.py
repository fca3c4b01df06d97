"""Path editing: armatures whose motion follows a curve while the curve is edited.

- `settings`             the stored state of a path edit, and the armatures that a button acts on
- `curve`                the new path: a curve object, read as a path of the core or created from one; the ground
- `armature_adapter`     reads an armature's motion and writes the edited one; `keys` in place, channel by channel
- `rigs`                 adapters of rigs of any kind: sampled once (`rig_sampling`, `rig_source`), their body
                         identified (`rig_parts`), their controls solved (`rig_transfer`) with `..rigs.control_study`
- `edited_bodies`        starts, updates, applies and reverts path edits
- `live`                 detects edits and updates the motion; measures it once the curve is at rest
- `collision_avoidance`  finds collisions of edited bodies and other bodies, and adds waits and detours
"""

REGISTERED = ("live", "settings")
