"""The ball and the players who keep it in play, as Blender's data.

- `settings`: the properties of the panel: players, passes, the ball, weights; the hit analysis of an armature
- `hit_analysis`: hit analysis of an armature: figures, markers on its action, its curves as a picture
- `scene_lists`: the lists as a passing scene of the core, and back; strikes of armatures as examples of passes
- `generate`: the scene's result on characters, ball and net, and its trajectories; `live` updates it after each edit;
  `characters` holds the objects that show it
- `tracked`: the ball of imported tracking data, solved
- `possession`: a ball carried by a bone for some frames, without a jump at either end
"""

REGISTERED = ("hit_analysis", "live", "settings")
