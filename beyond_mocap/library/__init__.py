"""A folder of recorded clips, made searchable once.

`folder` finds recordings and annotations, `read_clips` repairs them and adds a mirrored twin of each, `build` makes and
caches a `library` of them. `features` describes every frame by a few numbers, `clusters` groups blocks of frames,
`keys` finds the clips that can serve a key moment. `synthetic_clips` and `loops` complete the recordings' locomotion,
`missing_actions` builds the actions that labels ask for and no recording shows, `receptions` cuts receptions out of
dribbles.
"""
