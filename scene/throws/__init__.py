"""A throw or kick at a target: a network makes it, the body plays it, and the ball flies.

- `settings`   what the panel shows and what an armature keeps of its throw
- `order`      the settings as plain values: who, from where, at what, when; what target and ball do
- `made`       the throw that an order asks for, worked out in any thread
- `shown`      the throw laid on the armature, kept or taken away again; made again where target or settings changed
- `rigged`     the same on the controls of a rig
- `flown`      the ball: in the hand or lying, then its flight and its trajectory
"""
