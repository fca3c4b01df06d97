"""Run the command line: `python -m beyond_mocap VERB ...`, see `cli.main`."""

import os
import signal
import sys

_CORE_PACKAGES = ("numpy", "scipy", "threadpoolctl")


def run() -> int:
    """Run the command line; a missing package of the core is one line, as a fresh clone has no installed packages, and
    so is Ctrl-C while the packages are loaded.
    """
    signal.signal(signal.SIGINT, _end_at_once)
    try:
        from .cli.main import main

        signal.signal(signal.SIGINT, signal.default_int_handler)
        return main()
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in _CORE_PACKAGES:
            raise
        print(f"beyond-mocap: {package} is missing; install the core: pip install . in the project's folder",
              file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("beyond-mocap: cancelled", file=sys.stderr)
        return 130


def _end_at_once(*_) -> None:
    """End the program on Ctrl-C while packages are loaded: some turn an interrupt into errors of their own."""
    print("beyond-mocap: cancelled", file=sys.stderr, flush=True)
    os._exit(130)


if __name__ == "__main__":
    sys.exit(run())
