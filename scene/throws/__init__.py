"""A throw or kick at a target: a network makes it, the body plays it, and the ball flies.

- `settings`   what the panel shows and what an armature keeps of its throw
- `order`      the settings as plain values: who, from where, at what, when; worked off in any thread
- `shown`      the throw laid on the armature, and taken away again
- `rigged`     the same on the controls of a rig
- `flown`      the ball: in the hand or lying, then its flight and its trajectory
"""
