"""Characters of the user's file as bodies of players and teams: linked copies of an armature and its meshes, with the
motion retargeted onto their bones and the kit's colours on chosen materials.
"""

REGISTERED = ("settings",)
