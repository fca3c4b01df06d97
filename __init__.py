"""Beyond Mocap: full-body animation from tracking data and labels, inside Blender.

This file only registers and unregisters the extension. Its packages are registered in the order of ROOMS and
unregistered in reverse order; each does the same with its own modules. `bpy` is first imported when `register()` runs,
so this folder can be read as a plain Python package (by a test collector) without Blender.

Enabling must be quick. While it runs, a module that is imported as a whole from `scene` or the core
(`from ..scene.rigs import fit`) is loaded only when it is first used (`fit.read_source`); a name that is imported from
a module loads it at once.
"""

from contextlib import contextmanager
from functools import cache
from importlib import import_module
from os import listdir
from types import ModuleType

PACKAGES = ("scene", "operators", "panels")
LAZY = ("beyond_mocap", "scene")
_lazy: list[ModuleType] = []


def register():
    """Register all packages; if one fails, unregister those before it and raise its error."""
    registered = []
    try:
        with _import_lazily():
            for package in _iter_packages():
                package.register()
                registered.append(package)
    except BaseException:
        for package in reversed(registered):
            package.unregister()
        raise


def unregister():
    """Unregister all packages in reverse order."""
    for package in reversed(list(_iter_packages())):
        package.unregister()


def _iter_packages():
    return (import_module(f".{name}", __package__) for name in PACKAGES)


class _WaitingModule(ModuleType):
    """Stands for a module until one of its names is used; then Python imports the module, as always."""

    def __getattr__(self, name):
        return getattr(import_module(self.__name__), name)

    def __setattr__(self, name, value):
        setattr(import_module(self.__name__), name, value)

    def __delattr__(self, name):
        delattr(import_module(self.__name__), name)


@contextmanager
def _import_lazily():
    """Let the packages of LAZY give a waiting module for each that is not loaded, until the block ends."""
    try:
        for name in LAZY:
            _make_lazy(import_module(f".{name}", __package__))
        yield
    finally:
        while _lazy:
            _lazy.pop().__class__ = ModuleType


def _make_lazy(package):
    package.__class__ = _LazyPackage
    _lazy.append(package)


class _LazyPackage(ModuleType):
    """A package that gives waiting modules; Python sets each package below it here when it has imported it."""

    def __getattr__(self, name):
        if name in _list_modules(self.__path__[0]):
            return _WaitingModule(f"{self.__name__}.{name}")
        raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")

    def __setattr__(self, name, value):
        super().__setattr__(name, value)
        if type(value) is ModuleType and hasattr(value, "__path__"):
            _make_lazy(value)


@cache
def _list_modules(folder):
    """List the modules and packages of a folder by name. With pkgutil's list, enabling takes 8 % longer."""
    names = (name.removesuffix(".py") for name in listdir(folder) if not name.startswith("_"))
    return {name for name in names if "." not in name}
