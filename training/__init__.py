"""Training of the networks for throws and kicks; see docs/how-to/train-networks.md.

Not part of the extension: it needs jax and optax (`make training`). It writes a file of weights that
`beyond_mocap.throws.networks` uses with numpy alone.
"""

import os
import pathlib

if (os.cpu_count() or 1) <= 4:  # on few cores, waiting threads cost more time than they save
    os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")
# Compiling takes longer than a small training, so compiled code is cached.
_COMPILATION_CACHE = pathlib.Path(os.environ.get("XDG_CACHE_HOME", pathlib.Path.home()
                                                 / ".cache")) / "beyond-mocap" / "compiled"
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(_COMPILATION_CACHE))
