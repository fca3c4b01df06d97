"""Nearly all time of these tests goes into compiling networks that then run for a second: compiled without optimizing."""

import jax

jax.config.update("jax_disable_most_optimizations", True)
