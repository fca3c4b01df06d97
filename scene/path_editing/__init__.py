"""Path editing: armatures whose motion rides a curve, and follows it while it is edited.

- `settings`   what a rider keeps, and which riders a button means
- `curve`      what a rider follows: the curve object, read as a path of the core and made of one; the ground
- `carrier`    how an armature's motion is read and written, the original kept while a path is dragged; `keys` in place,
               channel by channel
- `rigs`       carriers of rigs of any kind: looked at once (`rig_look`, `rig_source`), their body found (`rig_parts`),
               their controls carried (`rig_ride`) by what `..rigs.control_study` finds
- `riders`     a ride begun, brought up to date, kept or ended
- `live`       sees that something has been edited, and brings riders up to date; their figures once they are at rest
- `keep_apart` finds who would run into whom, or into a bystander, and asks riders to wait or go round
"""
