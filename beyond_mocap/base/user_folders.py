"""The user's own folders."""

from __future__ import annotations

import os
from pathlib import Path


def find_user_cache() -> Path | None:
    """Find the program's folder in the user's cache folder, whether it exists or not.

    Returns:
        The folder; None for a user without a home, as of some containers.
    """
    base = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return None if base.startswith("~") else Path(base) / "beyond_mocap"
