"""A folder of recorded clips, made searchable once.

`scan` finds clips and annotations, `library` brings them together (with a mirrored twin of each), `features` describes
every frame by a few numbers, `clusters` groups blocks of frames, `keys` answers which clip can serve a key moment.
"""
