"""The contact sheet drawn without Blender: as many tiles as moments, and what is below the grass shows."""

import importlib.util
import pathlib
import sys
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.files.bvh import bvh

pytest.importorskip("PIL", reason="Pillow is not installed")
SAMPLE = pathlib.Path(__file__).parents[3] / "sample_blend"
TAKE = SAMPLE / "library" / "walking_1_2.bvh"


@pytest.fixture(scope="module")
def look():
    spec = importlib.util.spec_from_file_location("look", SAMPLE / "look.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["look"] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def magenta(path) -> int:
    from PIL import Image

    return int(np.sum(np.all(np.asarray(Image.open(path)) == (255, 0, 255), axis=-1)))


def test_a_body_on_the_grass_shows_no_magenta_and_a_sunken_one_does(look, tmp_path):
    motion = bvh.read_bvh(TAKE).motion
    sunken = replace(motion, root_positions=motion.root_positions - [0.0, 0.0, 0.5])
    for name, one in (("on", motion), ("in", sunken)):
        look.write_sheet(one, [0.0, 10.0], tmp_path / f"{name}.png", columns=2, tile=80)
    assert magenta(tmp_path / "on.png") == 0 < magenta(tmp_path / "in.png")


@pytest.mark.parametrize("camera, size", [("follow", (160, 160)), ("fixed", (160, 160)), ("strobe", (400, 400))])
def test_every_camera_draws_every_moment(look, tmp_path, camera, size):
    from PIL import Image

    asked = ["--camera", camera, "--from", "0", "--to", "0.6", "--every", "0.2", "--columns", "2", "--tile", "80"]
    assert look.main([str(TAKE), "--out", str(tmp_path / "sheet.png"), *asked]) == 0
    assert Image.open(tmp_path / "sheet.png").size == size


def test_without_pillow_one_line_says_what_to_do(look, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "PIL", None)
    assert look.main([str(TAKE), "--out", str(tmp_path / "sheet.png")]) == 2
    assert capsys.readouterr().err.endswith("Pillow is not installed; expected Pillow for the picture; "
                                            "pip install pillow\n")


def test_bad_input_is_told_in_one_line(look, tmp_path, capsys):
    assert look.main([str(tmp_path / "none.bvh"), "--out", str(tmp_path / "sheet.png")]) == 2
    assert look.main([str(TAKE), "--out", str(tmp_path / "sheet.png"), "--from", "900"]) == 2
    assert look.main([str(TAKE), "--out", str(tmp_path / "none" / "sheet.png")]) == 2
    assert look.main([str(TAKE), "--out", str(tmp_path / "sheet.txt")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 4 and "sheet.txt: file type .txt; expected a picture" in error
