"""Figures over a folder of reconstructed trials, as Fredriksson §8.1-8.2 has them: how well markers fit and how long it
took, where throws land, how fast they are beside a speed gun.

    page = trials_report(folder)

`folder` is what `beyond-mocap reconstruct FOLDER --out OUT` wrote.
"""
