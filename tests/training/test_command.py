"""`throw train` as somebody types it: whatever is wrong is one line before anything is read or written."""

import json

import pytest

from beyond_mocap.cli.main import main
from beyond_mocap.throws.synthetic_examples import write_examples
from tests.core.throws.test_throw import STICK


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("train")
    write_examples(folder / "throws", "throw", 1, 2, 5)
    (folder / "stick.bvh").write_text(STICK)
    (folder / "bad.json").write_text(json.dumps({"units": 0}))
    return folder


@pytest.mark.parametrize("more, said", [
    (("--config", "no.json"), "no.json: no such file"),
    (("--config", "bad.json"), "bad.json: model settings: units: 0"),
    (("--resume",), "w.checkpoint.npz: no such file"), (("--skeleton", "stick.bvh"), "stick.bvh: skeleton"),
    (("--action", "kick"), "none with a kick, 2 with a throw"), (("--seed", "-1"), "--seed"),
    (("--seed", "1e3"), "--seed"), (("--subject", "nobody"), "nobody"), (("--minutes", "nan"), "--minutes"),
])
def test_what_is_wrong_is_one_line(place, tmp_path, monkeypatch, capsys, more, said):
    monkeypatch.chdir(place)
    assert main(["throw", "train", "throws", "--out", str(tmp_path / "w.npz"), *more]) == 2
    told = capsys.readouterr().err
    assert said in told and told.count("\n") == 1 and not list(tmp_path.iterdir())


def test_the_checkpoints_place_may_not_be_a_folder(place, tmp_path, capsys):
    (tmp_path / "w.checkpoint.npz").mkdir()
    assert main(["throw", "train", str(place / "throws"), "--out", str(tmp_path / "w.npz")]) == 2
    assert "w.checkpoint.npz: is a folder" in capsys.readouterr().err
