"""A folder of recorded clips, made searchable once.

`folder` finds clips and annotations, `library` combines them (with a mirrored twin of each), `features` describes every
frame by a few numbers, `clusters` groups blocks of frames, `keys` finds the clips that can serve a key moment.
`synthetic_clips` and `loops` complete the recordings' locomotion, `missing_actions` builds the actions that labels ask
for and no recording shows, `receptions` cuts receptions out of dribbles.
"""
