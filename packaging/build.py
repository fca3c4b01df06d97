"""Build the extension's zips into build/extension, one per platform and Python.

Each contains the extension's code, the wheels, the complete manifest and a bill of materials, packed and validated by
Blender's own tool. The bill also stands beside the zip.

    .venv/bin/python packaging/build.py --platforms linux-x64 windows-x64 --maintainer "Name <name@host>"
"""

import argparse
import platform
import shutil
import subprocess
import sys
import tomllib

import bundle
import lint
import wheels

TOP = bundle.HERE.parent
OUT = TOP / "build" / "extension"
SBOM = "sbom.cdx.json"
PARTS = ("__init__.py", "batch.py", "LICENSE", "README.md", "SECURITY.md", "CHANGELOG.md", "beyond_mocap", "scene",
         "operators", "panels", *(f"sample_blend/{part}" for part in ("library", "match", "passes", "markers")))
IGNORE = shutil.ignore_patterns("__pycache__", "*.pyc", ".beyond_mocap")


def main(argv=None):
    """Fetch, stage, lint, validate, build and lint again; return 0 if the zips are complete."""
    known = {target.platform for target in bundle.list_targets()}
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--platforms", nargs="+", choices=sorted(known), default=[find_own_platform()])
    parser.add_argument("--maintainer", help="who answers for these zips, as 'Name <mail>'; without it a placeholder")
    options = parser.parse_args(argv)
    exit_on_complaints(lint.check_maintainer(options.maintainer) if options.maintainer else [])
    packages = bundle.list_packages()

    shutil.rmtree(OUT, ignore_errors=True)
    for target in bundle.list_targets(*options.platforms):
        path = build_zip(packages, target, options.maintainer)
        print(f"built {path.relative_to(TOP)}: {path.stat().st_size / 1e6:.1f} MB", flush=True)
    if not options.maintainer:
        print(f"\n{'*' * 96}\n** NOT TO BE PUBLISHED: the zips name a placeholder as maintainer. Build them with"
              f"\n**     make extension MAINTAINER='Name <name@host>'\n{'*' * 96}\n", file=sys.stderr)
    return 0


def find_own_platform():
    """Find Blender's name of this machine's platform."""
    system = {"win32": "windows", "darwin": "macos"}.get(sys.platform, "linux")
    return f"{system}-{'arm64' if platform.machine().lower() in ('arm64', 'aarch64') else 'x64'}"


def list_zips(platform_name):
    """List the built zips of a platform."""
    return sorted(OUT.glob(f"*-{platform_name.replace('-', '_')}_*.zip"))


def build_zip(packages, target, maintainer=None):
    """Build the zip for one platform and Python.

    Args:
        packages: the bundled packages.
        target: what the zip is for.
        maintainer: name and address; None for the manifest's own.
    Returns:
        The zip's path.
    """
    folder = OUT / "stage" / target.name
    fill_stage(folder, packages, target, maintainer)
    exit_on_complaints(lint.lint_stage(folder, packages, target))
    path = OUT / f"beyond_mocap-{read_version()}-{target.name.replace('-', '_')}.zip"
    pack_zip(folder, path)
    shutil.copyfile(folder / SBOM, path.with_suffix(".cdx.json"))
    exit_on_complaints(lint.lint_zip(path, target))
    return path


def fill_stage(folder, packages, target, maintainer=None):
    """Fill the staging folder that Blender's own tool packs.

    Args:
        folder: the staging folder.
        packages: the bundled packages.
        target: what the zip is for.
        maintainer: name and address; None for the manifest's own.
    """
    names = wheels.copy_wheels(packages, target, folder / "wheels")
    copy_parts(TOP, folder)
    text = (TOP / "blender_manifest.toml").read_text("utf-8")
    manifest = complete_manifest(text, packages, target, names, maintainer)
    (folder / "blender_manifest.toml").write_text(manifest, "utf-8")
    scripts = "Scripts" if sys.platform == "win32" else "bin"
    subprocess.run([TOP / ".venv-pack" / scripts / "python", TOP / "packaging" / "sbom.py", folder], check=True)


def read_version():
    """Read the version from the manifest."""
    return tomllib.loads((TOP / "blender_manifest.toml").read_text("utf-8"))["version"]


def pack_zip(folder, path):
    """Validate the folder and build the zip with Blender's own tool."""
    run_extension_tool("validate", str(folder))
    run_extension_tool("build", "--source-dir", str(folder), "--output-filepath", str(path))


def run_extension_tool(*arguments):
    """Run what `blender --command extension` runs; exit if it fails."""
    import bpy  # noqa: F401  (brings bl_pkg)
    from bl_pkg.bl_extension_cli import cli_extension_handler

    if cli_extension_handler(list(arguments)) != 0:
        sys.exit(f"Blender's extension tool failed: {' '.join(arguments)}")


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


def complete_manifest(text, packages, target, wheels, maintainer=None):
    """Complete the manifest with Blender's versions, the platform, the wheels and a copyright line per bundled package.

    Args:
        text: the committed manifest.
        packages: the bundled packages.
        target: what the zip is for.
        wheels: file names of the wheels.
        maintainer: name and address; None for the manifest's own.
    Returns:
        The manifest's text.
    """
    own = tomllib.loads(text)
    holders = [f"{package.copyright} ({package.name} {package.version}, {package.license})" for package in packages]
    values = {"maintainer": _quote(maintainer or own["maintainer"]),
              "blender_version_min": _quote(target.blender_min),
              "copyright": _format_list(map(_quote, [*own["copyright"], *holders])),
              "platforms": _format_list([_quote(target.platform)]),
              "wheels": _format_list(_quote(f"./wheels/{name}") for name in wheels)}
    if target.blender_max:
        values["blender_version_max"] = _quote(target.blender_max)
    kept = [line for line in text.splitlines() if line.partition(" = ")[0] not in values]
    table = next((number for number, line in enumerate(kept) if line.startswith("[")), len(kept))
    kept[table:table] = [*(f"{key} = {value}" for key, value in values.items()), ""]
    return "\n".join(kept) + "\n"


def _quote(value):
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _format_list(items):
    return "[\n" + "".join(f"  {item},\n" for item in items) + "]"


if __name__ == "__main__":
    sys.exit(main())
