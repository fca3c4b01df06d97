"""Build the extension's zips into build/extension, one per platform.

Each contains the extension's code, the wheels and the complete manifest, packed and validated by Blender's own tool.

    .venv/bin/python packaging/build.py --platforms linux-x64 windows-x64
"""

import argparse
import shutil
import sys
import tomllib

import bundle
import lint
import wheels

TOP = bundle.HERE.parent
OUT = TOP / "build" / "extension"
PARTS = ("__init__.py", "batch.py", "LICENSE", "README.md", "CHANGELOG.md", "beyond_mocap", "scene", "operators",
         "panels", *(f"sample_blend/{part}" for part in ("library", "match", "passes", "markers")))
IGNORE = shutil.ignore_patterns("__pycache__", "*.pyc", ".beyond_mocap")


def main(argv=None):
    """Fetch, stage, lint, validate, build and lint again; return 0 if the zips are complete."""
    known = bundle.read_platforms()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--platforms", nargs="+", choices=sorted(known), default=["linux-x64"])
    names = parser.parse_args(argv).platforms
    packages = bundle.list_packages()

    shutil.rmtree(OUT, ignore_errors=True)
    for platform in (known[name] for name in names):
        path = build_zip(packages, platform)
        print(f"built {path.relative_to(TOP)}: {path.stat().st_size / 1e6:.1f} MB", flush=True)
    return 0


def build_zip(packages, platform):
    """Build the zip for one platform.

    Args:
        packages: the bundled packages.
        platform: the platform.
    Returns:
        The zip's path.
    """
    folder = OUT / "stage" / platform.name
    fill_stage(folder, packages, platform)
    exit_on_complaints(lint.lint_stage(folder, packages, platform))
    pack_zip(folder, OUT)
    path = OUT / f"beyond_mocap-{read_version()}-{platform.name.replace('-', '_')}.zip"
    exit_on_complaints(lint.lint_zip(path, platform))
    return path


def fill_stage(folder, packages, platform):
    """Fill the staging folder that Blender's own tool packs.

    Args:
        folder: the staging folder.
        packages: the bundled packages.
        platform: the platform.
    """
    names = wheels.copy_wheels(packages, platform, folder / "wheels")
    copy_parts(TOP, folder)
    text = (TOP / "blender_manifest.toml").read_text("utf-8")
    manifest = complete_manifest(text, packages, platform.name, names)
    (folder / "blender_manifest.toml").write_text(manifest, "utf-8")


def read_version():
    """Read the version from the manifest."""
    return tomllib.loads((TOP / "blender_manifest.toml").read_text("utf-8"))["version"]


def pack_zip(folder, out):
    """Validate the folder and build the zip of its one platform with Blender's own tool."""
    import bpy  # noqa: F401  (brings bl_pkg)
    from bl_pkg.bl_extension_cli import cli_extension_handler as extension_tool

    for verb in (["validate", str(folder)],
                 ["build", "--source-dir", str(folder), "--output-dir", str(out), "--split-platforms"]):
        if extension_tool(verb) != 0:
            sys.exit(f"Blender's extension tool failed: {verb[0]} {folder}")


def exit_on_complaints(lines):
    """Exit with these lines, if there are any."""
    if lines:
        sys.exit("\n".join(lines))


def copy_parts(source, folder):
    """Copy the shipped parts of the clone at `source` into `folder`; missing files are skipped."""
    for part in PARTS:
        path = source / part
        if path.is_dir():
            shutil.copytree(path, folder / part, ignore=IGNORE)
        elif path.exists():
            shutil.copyfile(path, folder / part)


def complete_manifest(text, packages, platform, wheels):
    """Complete the manifest with the platform, the wheels and a copyright line per bundled package.

    Args:
        text: the committed manifest.
        packages: the bundled packages.
        platform: the platform's name.
        wheels: file names of the wheels.
    Returns:
        The manifest's text.
    """
    holders = [
        f"{package.copyright} ({package.name} {package.bundled_version}, {package.license})" for package in packages
    ]
    own = next(line for line in text.splitlines() if line.startswith("copyright = "))
    own_holders = own.removeprefix("copyright = [").removesuffix("]")
    lines = [f"copyright = {_format_list([own_holders, *map(_quote, holders)])}",
             f"platforms = {_format_list([_quote(platform)])}",
             f"wheels = {_format_list(_quote(f'./wheels/{name}') for name in wheels)}"]
    return text.replace(own, "\n".join(lines))


def _quote(value):
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _format_list(items):
    return "[\n" + "".join(f"  {item},\n" for item in items) + "]"


if __name__ == "__main__":
    sys.exit(main())
