"""Beyond Mocap: full-body animation from tracking data and labels, inside Blender.

This file only registers and unregisters the extension. Its packages are registered in the order of ROOMS and
unregistered in reverse order; each does the same with its own modules. `bpy` is first imported when `register()` runs,
so this folder can be read as a plain Python package (by a test collector) without Blender.

Enabling must be quick. While it runs, a module that is imported as a whole from `scene` or the core
(`from ..scene.rigs import fit`) is loaded only when it is first used (`fit.read_source`); a name that is imported from
a module loads it at once.
"""

import sys
from contextlib import contextmanager
from importlib import import_module
from importlib.machinery import SourceFileLoader
from importlib.util import spec_from_file_location
from os import listdir
from os.path import dirname, isfile, join
from types import ModuleType

PACKAGES = ("scene", "operators", "panels")
LAZY = (f"{__package__}.beyond_mocap", f"{__package__}.scene")


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
    finder = _LazyPackages()
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)
        for package in finder.loaded:
            del package.__getattr__


class _LazyPackages:
    """Finds the packages of LAZY and those below them, for Python's import; `loaded` are those that were imported."""

    def __init__(self):
        self.loaded = []

    def find_spec(self, name, path, _target=None):
        if not name.startswith(LAZY) or not isfile(file := join(path[0], name.rpartition(".")[2], "__init__.py")):
            return None
        loader = _PackageLoader(name, file, self.loaded)
        return spec_from_file_location(name, file, loader=loader, submodule_search_locations=[dirname(file)])


class _PackageLoader(SourceFileLoader):
    """Loads a package, whose modules then wait, and adds it to `loaded`."""

    def __init__(self, name, file, loaded):
        super().__init__(name, file)
        self.loaded = loaded

    def exec_module(self, module):
        super().exec_module(module)
        module.__getattr__ = _build_getter(module, _list_modules(module.__path__[0]))
        self.loaded.append(module)


def _list_modules(folder):
    """List the modules and packages of a folder by name. With pkgutil's list, enabling takes 8 % longer."""
    names = (name.removesuffix(".py") for name in listdir(folder) if not name.startswith("_"))
    return {name for name in names if "." not in name}


def _build_getter(package, modules):
    def find_module(name):
        if name in modules:
            return _WaitingModule(f"{package.__name__}.{name}")
        raise AttributeError(f"module {package.__name__!r} has no attribute {name!r}")

    return find_module
