"""Throws and kicks from phase-functioned networks: a body follows where its hands and feet are to be, and lets the ball
go at the asked moment (Fredriksson ch. 7). Numpy only; `training/` makes the weights.

`network` is one network and how it is evaluated, `model` is all that one file of weights holds, `phases` tells how far
a movement has come and how much each control point of a network counts then.
"""
