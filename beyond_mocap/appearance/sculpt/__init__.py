"""The player's body, sculpted from formulas: smooth distance fields, meshed, dressed and weighted, without any tool.

`python -m beyond_mocap.appearance.sculpt` writes the templates that `appearance.body` fits to skeletons. All lengths
are metres for a stature of 1.80 m; x points ahead, y to the left, z up.
"""
