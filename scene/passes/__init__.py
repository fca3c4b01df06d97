"""The ball and the players who keep it going, as Blender's data.

- `settings`   what the panel shows: players, passes, the ball, weights; what an armature keeps of its hit analysis
- `hits_shown` hit analysis of an armature: figures for the panel, markers on its action
- `graph`      its curves as a small picture
- `order`      the lists as a passing scene of the core, and back
- `examples`   strikes of armatures that passes are to be like
- `make`       it is made: bodies, ball, net; `live` again after each edit; `shown` on whom, and given back; `rally`
               what is drawn of it; `held_tool` a racquet in the hand
- `tracked`    the ball of imported tracking, solved
- `possession` a ball carried by a bone for a while, without a jump at either end
"""
