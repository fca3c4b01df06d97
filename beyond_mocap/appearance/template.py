"""The sculpted athlete as arrays, read from the files that `python -m beyond_mocap.appearance.sculpt` writes."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent / "templates"


@dataclass(frozen=True, eq=False, kw_only=True)
class Template:
    """The athlete of 1.80 m with lifted arms, V vertices and F faces.

    Attributes:
        vertices: (V, 3) m.
        faces: (F, 4) vertex indices, counterclockwise from outside; -1 last in triangles.
        materials: (F,) indices into `mesh.MATERIALS`.
        parts: (F,) 0 for the body, i + 1 for the i-th of `look.HAIR_STYLES`.
        segments: (V, 4) indices into `landmarks.SEGMENTS`, the largest share first.
        shares: (V, 4) their shares, sum 1.
        gloves: (V,) m by which a keeper's gloves stand out.
    """

    vertices: np.ndarray
    faces: np.ndarray
    materials: np.ndarray
    parts: np.ndarray
    segments: np.ndarray
    shares: np.ndarray
    gloves: np.ndarray


_STORED = {"vertices": np.float32, "faces": np.int16, "materials": np.uint8, "parts": np.uint8, "segments": np.uint8,
           "shares": np.float32, "gloves": np.float32}


def write_template(template: Template, path: Path) -> None:
    """Write a template as compressed arrays."""
    np.savez_compressed(path, **{name: getattr(template, name).astype(kind) for name, kind in _STORED.items()})


@lru_cache(maxsize=2)
def read_template(light: bool) -> Template:
    """Read the full body, or the light one."""
    with np.load(FOLDER / ("light.npz" if light else "athlete.npz"), allow_pickle=False) as stored:
        arrays = {one.name: stored[one.name] for one in fields(Template)}
    for name, array in arrays.items():
        arrays[name] = array.astype(float if array.dtype.kind == "f" else int)
        arrays[name].flags.writeable = False
    return Template(**arrays)
