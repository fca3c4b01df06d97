"""Register everything that the modules of a package define: there is no list of classes to maintain.

Enabling is quick because it loads only the modules that have something to register. A package of `scene`, most of whose
modules have nothing, names those that do in `REGISTERED`, as `scene` names its packages; a test finds what is missing
there.

A class is registered because it is a Blender class that a module defines; one that is attached to Blender's own data
says so in `attached_to` ("Scene.beyond_mocap"). A module that needs more has a function `register()`, `unregister()` or
both. A package with `register()` in its `__init__` handles its own modules.

A module whose classes have properties does without `from __future__ import annotations`: Blender would compile the text
of each property again at every start. A type that is only loaded for the checker is quoted there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from importlib import import_module
from inspect import get_annotations
from os import listdir
from types import ModuleType

import bpy

KINDS = (bpy.types.PropertyGroup, bpy.types.Operator, bpy.types.FileHandler, bpy.types.UIList, bpy.types.Menu,
         bpy.types.Panel, bpy.types.Header, bpy.types.AddonPreferences)
_undo_steps: dict[str, list[Callable[[], None]]] = {}


def register_package(package: str) -> None:
    """Register everything that a package's modules define; if a step fails, undo those before it and raise the error
    again.

    Args:
        package: its full name, `__name__` in its `__init__`.
    """
    undoing = _undo_steps[package] = []
    try:
        for do, undo in _iter_steps(package):
            do()
            undoing.append(undo)
    except BaseException:
        unregister_package(package)
        raise


def unregister_package(package: str) -> None:
    """Undo `register_package`, the last step first."""
    undoing = _undo_steps.pop(package)
    while undoing:
        undoing.pop()()


def sort_classes(classes: Iterable[type]) -> list[type]:
    """Sort classes by kind, each after those that it needs.

    Args:
        classes: the classes.
    Returns:
        The classes in the order of registration.
    """
    classes = sorted(classes, key=lambda cls: next(n for n, kind in enumerate(KINDS) if issubclass(cls, kind)))
    by_name = {cls.__name__: cls for cls in classes}
    ordered: dict[type, None] = {}

    def add_class(cls: type) -> None:
        for needed in _list_requirements(cls, by_name):
            add_class(needed)
        ordered.setdefault(cls)

    for cls in classes:
        add_class(cls)
    return list(ordered)


def _iter_steps(package: str) -> Iterator[tuple[Callable[[], None], Callable[[], None]]]:
    """Iterate over pairs of a step and its undo: classes, their places in Blender's data, then the modules' own
    hooks.
    """
    modules = list(_iter_modules(import_module(package)))
    classes = sort_classes(cls for module in modules for cls in _list_classes(module))
    for cls in classes:
        _add_old_name(cls)
        yield partial(bpy.utils.register_class, cls), partial(bpy.utils.unregister_class, cls)
    for cls in classes:
        for place in getattr(cls, "attached_to", ()):
            owner, _, name = place.partition(".")
            owner = getattr(bpy.types, owner)
            yield partial(_attach_property, owner, name, cls), partial(delattr, owner, name)
    for module in modules:
        yield getattr(module, "register", _do_nothing), getattr(module, "unregister", _do_nothing)


def _iter_modules(package: ModuleType) -> Iterator[ModuleType]:
    """Iterate over the modules below a package by name: those in its `REGISTERED`, or all, and those of its packages;
    of a package that registers itself, only that package.
    """
    for name in getattr(package, "REGISTERED", None) or _list_names(package):
        module = import_module(f"{package.__name__}.{name}")
        yield module
        if hasattr(module, "__path__") and not hasattr(module, "register"):
            yield from _iter_modules(module)


def _list_names(package: ModuleType) -> list[str]:
    """List the modules and packages in a package's folder; importing pkgutil for it would take a millisecond."""
    names = (name.removesuffix(".py") for name in listdir(package.__path__[0]))
    return sorted(name for name in names if name.isidentifier() and not name.startswith("_"))


def _list_classes(module: ModuleType) -> list[type]:
    """List the Blender classes that a module defines, in the order of its lines."""
    defined = [thing for thing in vars(module).values() if isinstance(thing, type)]
    return [cls for cls in defined if cls.__module__ == module.__name__ and issubclass(cls, KINDS)]


def _list_requirements(cls: type, by_name: dict[str, type]) -> list[type]:
    """List the classes that must be registered before this one: targets of its properties, or a panel's parent."""
    if issubclass(cls, bpy.types.PropertyGroup):
        targets = (getattr(hint, "keywords", {}).get("type") for hint in get_annotations(cls).values())
        return [target for target in targets if target in by_name.values()]
    parent = by_name.get(getattr(cls, "bl_parent_id", None))
    return [parent] if parent is not None else []


def _attach_property(owner: type, name: str, cls: type) -> None:
    setattr(owner, name, bpy.props.PointerProperty(type=cls))


def _add_old_name(cls: type) -> None:
    """Let scripts of version 0.1 read the status property `messages` by its name of then, for one version."""
    if "messages" in get_annotations(cls):
        cls.told = property(lambda self: self.messages)


def _do_nothing() -> None:
    """Do nothing, for a module without a hook."""
