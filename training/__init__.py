"""Training of the networks behind throws and kicks; see docs/throws-training.md.

Not part of the extension: it needs jax and optax (`make training`). What it makes is a file of weights that
`beyond_mocap.synthesis.phase_network` uses with numpy alone.
"""
