"""Path editing: armatures whose motion rides a curve, and follows it while it is edited.

- `settings`  what a rider keeps, and which riders a button means
- `curve`     the curve object: read as a path of the core, and made of one
- `carrier`   how an armature's motion is read and written; `keys` in place, channel by channel
- `rigs`      carriers of rigs of any kind: looked at once (`rig_look`, `rig_source`), their body found (`rig_parts`),
              their controls carried (`rig_ride`) by what `..rigs.control_study` finds
- `source`    the original motion relative to its own path, kept while a path is dragged; the ground
- `riders`    a ride begun, brought up to date, kept or ended
- `live`      sees that something has been edited, and brings riders up to date
- `measure`   a rider's figures, in a thread once it is at rest
- `bystanders` are the other bodies of a scene, of which riders keep clear
- `keep_apart` finds who would run into whom, and asks them to wait or go round
"""
