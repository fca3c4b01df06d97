"""Build a static extension repository in build/repository from the zips in build/extension: index, page and zips.

    .venv/bin/python packaging/repository.py

Any web server can serve the folder. Blender's own tool reads the zips and writes the index.
"""

import pathlib
import shutil
import sys

import build

REPOSITORY = build.TOP / "build" / "repository"


def main():
    """Build the repository; return 0."""
    zips = sorted(build.OUT.glob("*.zip"))
    if not zips:
        sys.exit("build/extension: found no zip, expected some; run 'make extension'")
    shutil.rmtree(REPOSITORY, ignore_errors=True)
    build_repository(zips, REPOSITORY)
    print(f"the repository stands in build/repository: {len(zips)} zips")
    return 0


def build_repository(zips: list[pathlib.Path], folder: pathlib.Path):
    """Copy zips and their bills of materials into a new folder, and let Blender's tool index them.

    Args:
        zips: the extension's zips.
        folder: the folder to make.
    """
    folder.mkdir(parents=True)
    for path in zips:
        for one in path.parent.glob(f"{path.stem}.*"):
            shutil.copyfile(one, folder / one.name)
    build.run_extension_tool("server-generate", "--repo-dir", str(folder), "--html")


if __name__ == "__main__":
    sys.exit(main())
