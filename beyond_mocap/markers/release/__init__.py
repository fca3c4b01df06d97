"""Estimate when a ball leaves a hand, and how it leaves (Fredriksson chapter 6).

With a marker on the ball, its flight is fitted together with the release time (`launch_fit`); without one, the motion
of the hand is the evidence (`without_ball`). Units are metres and seconds, Z up, on the trial's frames.
"""
