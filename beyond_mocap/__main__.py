"""Run the command line: `python -m beyond_mocap VERB ...`, see `cli.main`."""

import sys

from .cli.main import main

if __name__ == "__main__":
    sys.exit(main())
