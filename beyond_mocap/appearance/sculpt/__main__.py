"""Write the templates of the body: `python -m beyond_mocap.appearance.sculpt`."""

from __future__ import annotations

from ..template import FOLDER, write_template
from .athlete import sculpt


def main() -> None:
    """Sculpt both bodies and write them beside the code."""
    FOLDER.mkdir(exist_ok=True)
    for name, light in (("athlete", False), ("light", True)):
        template = sculpt(light)
        write_template(template, FOLDER / f"{name}.npz")
        print(f"{name}: {len(template.vertices)} vertices, {(template.parts == 0).sum()} faces without hair")


if __name__ == "__main__":
    main()
