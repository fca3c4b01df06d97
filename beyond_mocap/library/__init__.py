"""A folder of recorded clips, made searchable once.

`scan` finds clips and annotations, `library` combines them (with a mirrored twin of each), `features` describes every
frame by a few numbers, `clusters` groups blocks of frames, `keys` finds the clips that can serve a key moment.
"""
