"""Beyond Mocap: full-body animation from tracking data and labels, inside Blender.

This file only registers and unregisters the extension. Its packages are registered in the order of ROOMS and
unregistered in reverse order; each does the same with its own modules. `bpy` is first imported when `register()` runs,
so this folder can be read as a plain Python package (by a test collector) without Blender.

Enabling must be quick. While it runs, a module that is imported as a whole from `scene` or the core
(`from ..scene.rigs import fit`) is loaded only when it is first used (`fit.read_source`); a name that is imported from
a module loads it at once.
"""

from contextlib import contextmanager
from importlib import import_module
from os import listdir
from os.path import isfile, join
from types import ModuleType

PACKAGES = ("scene", "operators", "panels")
LAZY = ("beyond_mocap", "scene")
FULL = {"annotation"}
"""Packages that are loaded as a whole when they are first used: they import their own modules."""


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
    packages = [found for name in LAZY for found in _iter_lazy_packages(f"{__package__}.{name}")]
    for package, modules in packages:
        package.__getattr__ = _build_getter(package, modules)
    try:
        yield
    finally:
        for package, _ in packages:
            del package.__getattr__


def _iter_lazy_packages(name):
    """Import a package and those below it; yield each with its modules."""
    package = import_module(name)
    modules = _list_modules(package.__path__[0])
    yield package, modules
    for found, is_package in modules.items():
        if is_package and found not in FULL:
            yield from _iter_lazy_packages(f"{name}.{found}")


def _list_modules(folder):
    """List a folder's modules -> whether each is a package. With pkgutil's list, enabling takes 8 % longer."""
    names = [name for name in listdir(folder) if not name.startswith("_")]
    modules = {name.removesuffix(".py"): False for name in names if name.endswith(".py")}
    return modules | {name: True for name in names if "." not in name and isfile(join(folder, name, "__init__.py"))}


def _build_getter(package, modules):
    def find_module(name):
        if name in modules:
            return _WaitingModule(f"{package.__name__}.{name}")
        raise AttributeError(f"module {package.__name__!r} has no attribute {name!r}")

    return find_module
