"""Packages that only some tasks need: imported on use, named with the extra of pyproject.toml that installs them."""

from __future__ import annotations

import logging
from importlib import import_module
from types import ModuleType

from .errors import InputError

EXTRAS = {
    "learn": ("sklearn",), "match": ("kloppy", "joblib"), "cluster": ("distributed",), "markers": ("c3d",),
    "plots": ("matplotlib",), "training": ("jax", "optax"),
}  # fmt: skip
"""Extra of pyproject.toml -> the packages that the code imports from it."""
_EXTRA_OF = {package: extra for extra, packages in EXTRAS.items() for package in packages}
_WARNING_PACKAGES = ("matplotlib",)  # it warns in three lines where no home folder is found


def import_optional(name: str, where: object) -> ModuleType:
    """Import a module of an optional package.

    Args:
        name: the module, such as "sklearn.svm"; its package is one of `EXTRAS`.
        where: the file or task that needs it, for the error.
    Returns:
        The module.
    Raises:
        InputError: with the extra to install, if it cannot be imported.
    """
    package = name.partition(".")[0]
    extra = _EXTRA_OF[package]
    if package in _WARNING_PACKAGES:
        logging.getLogger(package).setLevel(logging.ERROR)
    try:
        return import_module(name)
    except ImportError as error:
        raise InputError(where, f"{package} cannot be imported ({error})", f"the extra '{extra}'",
                         f"in the project's folder run: pip install '.[{extra}]'") from None
