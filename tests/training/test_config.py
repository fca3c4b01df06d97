"""The config: unknown names and bad values are refused in one line that names the place."""

import json

import pytest

from beyond_mocap.errors import InputError
from training.config import TrainingConfig, config_of, read_config


def test_defaults_and_what_a_file_says(tmp_path):
    path = tmp_path / "c.json"
    path.write_text(json.dumps({"units": 32, "conditioned": False, "rollout": 1, "epochs": 7}))
    config = read_config(path, epochs=9, seed=None)
    assert (config.settings.units, config.settings.conditioned, config.epochs, config.seed) == (32, False, 9, 0)
    assert read_config(None) == TrainingConfig()
    assert config_of(config.flat()) == config


@pytest.mark.parametrize("text, said", [
    ('{"epoch": 3}', "epoch"), ('{"epochs": 2.5}', "epochs"), ('{"epochs": -1}', "epochs"), ('{"kind": "tree"}', "kind"),
    ('{"conditioned": 1}', "conditioned"), ('{"keep": NaN}', "NaN"), ('{"units": "many"}', "units"), ("[1]", "object"),
    ('{"seed": 1, "seed": 2}', "twice"), ("{", "JSON"), ('{"learning_rate": -1}', "learning_rate"),
])
def test_what_is_refused(tmp_path, text, said):
    path = tmp_path / "c.json"
    path.write_text(text)
    with pytest.raises(InputError, match=said) as error:
        read_config(path)
    assert len(str(error.value).splitlines()) == 1


def test_no_text_is_refused(tmp_path):
    (tmp_path / "c.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="no text"):
        read_config(tmp_path / "c.json")
