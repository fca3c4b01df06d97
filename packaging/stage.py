"""Lay out the folder that Blender's own tool packs: our code, the wheels and the complete manifest."""

import shutil

PARTS = (
    "__init__.py",
    "batch.py",
    "LICENSE",
    "README.md",
    "CHANGELOG.md",
    "beyond_mocap",
    "scene",
    "operators",
    "panels",
)
LEFT_OUT = shutil.ignore_patterns("__pycache__", "*.pyc")


def copy_parts(source, folder):
    """Copy what ships from the clone at `source` into `folder`; a text that is not written yet is passed over."""
    for part in PARTS:
        path = source / part
        if path.is_dir():
            shutil.copytree(path, folder / part, ignore=LEFT_OUT)
        elif path.exists():
            shutil.copyfile(path, folder / part)


def complete_manifest(text, packages, platform, wheels):
    """The committed manifest's text, with the platform, the wheels and a copyright line per bundled package."""
    holders = [
        f"{package.copyright} ({package.name} {package.bundled_version}, {package.license})" for package in packages
    ]
    own = next(line for line in text.splitlines() if line.startswith("copyright = "))
    ours = own.removeprefix("copyright = [").removesuffix("]")
    added = [
        f"copyright = {_list([ours, *map(_quoted, holders)])}",
        f"platforms = {_list([_quoted(platform)])}",
        f"wheels = {_list(_quoted(f'./wheels/{name}') for name in wheels)}",
    ]
    return text.replace(own, "\n".join(added))


def _quoted(value):
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _list(items):
    return "[\n" + "".join(f"  {item},\n" for item in items) + "]"
