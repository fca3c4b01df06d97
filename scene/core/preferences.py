"""The user's settings for all files, in Blender's preferences under Add-ons > Beyond Mocap.

Without them (an extension that a script enables has none), the defaults apply.
"""

from __future__ import annotations

import os
from pathlib import Path

import bpy

from . import sample
from .properties import with_settings

EXTENSION = __package__.removesuffix(".scene.core")


@with_settings("preferences")
class Preferences:
    """The properties; panels/preferences.py draws and registers them."""


def find_preferences() -> "Preferences | None":
    """Return the user's preferences; None where the extension has none."""
    addon = bpy.context.preferences.addons.get(EXTENSION)
    return addon.preferences if addon is not None else None


def count_threads() -> int:
    """Return how many threads may be used, at least one."""
    chosen = find_preferences()
    return (chosen.threads if chosen else 0) or os.cpu_count() or 1


def find_cache_folder(library_folder: str) -> str | None:
    """Return where the library of a folder is cached; None for beside its recordings, where the sample's never is."""
    from ...beyond_mocap.library import cache  # slow to import, and enabling the extension must be quick

    chosen = find_preferences()
    if chosen and chosen.cache_folder:
        return str(cache.find_own_folder(Path(bpy.path.abspath(chosen.cache_folder)), Path(library_folder)))
    if sample.is_in_sample(library_folder):
        return str(cache.find_own_folder(sample.find_cache_base(), Path(library_folder)))
    return None


def build_library_options(library_folder: str) -> dict:
    """Return the arguments of the core's `library.build` that the preferences set."""
    return {"cache_dir": find_cache_folder(library_folder), "threads": count_threads()}
