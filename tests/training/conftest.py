"""Nearly all time of these tests goes into compiling networks that then run for a second: compiled without optimizing.

By the environment, so that processes that tests start compile the same way: bits are compared between them.
"""

import os

os.environ["JAX_DISABLE_MOST_OPTIMIZATIONS"] = "1"  # read when jax is imported
