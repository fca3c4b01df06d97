"""The ball and the players who keep it going, as Blender's data.

- `settings`   what the panel shows: players, passes, the ball, weights; what an armature keeps of its hit analysis
- `hits_shown` hit analysis of an armature: figures, markers on its action, its curves as a picture
- `order`      the lists as a passing scene of the core, and back; strikes of armatures that passes are to be like
- `make`       it is made: bodies, ball, net, and what is drawn of it; `live` again after each edit; `shown` on whom,
               and given back; a racquet in the hand
- `tracked`    the ball of imported tracking, solved
- `possession` a ball carried by a bone for a while, without a jump at either end
"""
