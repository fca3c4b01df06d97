"""The moment in which a ball leaves a hand, and how it leaves (Fredriksson ch. 6).

With a marker on the ball, its flight is fitted together with the time of release (`launch_fit`); without one, the hand
tells (`without_ball`). Everything in metres, seconds, Z up, on the trial's frames.
"""
