"""Files of synthetic clips: one that says what cannot be is not used, whatever its checksum."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.files.piece_file import read_piece_file, write_piece_file
from beyond_mocap.library.actions.clip_file import load_clip, save_clip
from beyond_mocap.library.clip import SYNTHETIC_FOLDER

PATH = SYNTHETIC_FOLDER + "action_kick.bvh"


@pytest.fixture
def stored(library, tmp_path):
    """A clip at 60 frames per second, saved: (folder, its file)."""
    clip = next(clip for clip in library.clips if clip.path == "kick.bvh" and not clip.mirrored)
    (tmp_path / "made-gait").mkdir()
    save_clip(tmp_path, "key", replace(clip, path=PATH))
    (file,) = tmp_path.rglob("*.npz")
    return tmp_path, file


def rows(*row):
    return lambda header, _: header.update(rows=[list(row)])


@pytest.mark.parametrize("alter", [
    rows(0.0, 9.0, ["kick"]), rows(0.0, 1e6, None, ["kick"]), rows(None, 9.0, None, ["kick"]), rows(0.0, 9.0, None, 5),
    rows(0.0, 9.0, 1e6, ["kick"]), rows(9.0, 0.0, None, ["kick"]), lambda header, _: header.update(rows=5),
    lambda header, _: header.update(fps=0.0), lambda header, _: header.pop("rows") and None,
    lambda header, _: [header], lambda _, arrays: arrays.update(contacts=arrays["contacts"][1:]),
    lambda _, arrays: arrays.update(root=arrays["root"][:, :2]),
    lambda _, arrays: arrays.update(root=np.nan * arrays["root"]),
    lambda _, arrays: arrays.update(rotations=2.0 * arrays["rotations"]),
    lambda _, arrays: arrays.update(rotations=arrays["rotations"][:, 1:]),
    lambda _, arrays: arrays.update({name: values[:0] for name, values in arrays.items()}),
])  # fmt: skip
def test_a_clip_that_cannot_be_is_missing(library, stored, alter):
    folder, file = stored
    assert load_clip(folder, "key", library.skeleton, PATH) is not None
    assert load_clip(folder, "other", library.skeleton, PATH) is None
    header, arrays = read_piece_file(file)
    write_piece_file(file, alter(header, arrays) or header, arrays)
    assert load_clip(folder, "key", library.skeleton, PATH) is None
