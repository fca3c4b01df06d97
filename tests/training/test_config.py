"""The config: unknown names and bad values are refused in one line that names the place."""

import json
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from training.config import TrainingConfig, build_config, read_config


def test_defaults_and_what_a_file_says(tmp_path):
    path = tmp_path / "c.json"
    path.write_text(json.dumps({"units": 32, "conditioned": False, "rollout": 1, "epochs": 7}))
    config = read_config(path, epochs=9, seed=None)
    assert (config.settings.units, config.settings.conditioned, config.epochs, config.seed) == (32, False, 9, 0)
    assert read_config(None) == TrainingConfig()
    assert build_config(config.to_dict()) == config


@pytest.mark.parametrize("text, said", [
    ('{"epoch": 3}', "epoch"), ('{"epochs": 2.5}', "epochs"), ('{"epochs": -1}', "epochs"),
    ('{"kind": "tree"}', "kind"),
    ('{"conditioned": 1}', "conditioned"), ('{"keep": NaN}', "NaN"), ('{"units": "many"}', "units"), ("[1]", "object"),
    ('{"seed": 1, "seed": 2}', "'seed' is repeated"), ("{", "JSON"), ('{"learning_rate": -1}', "learning_rate"),
])
def test_what_is_refused(tmp_path, text, said):
    path = tmp_path / "c.json"
    path.write_text(text)
    with pytest.raises(InputError, match=said) as error:
        read_config(path)
    assert len(str(error.value).splitlines()) == 1 and str(error.value).startswith(str(path))


def test_what_is_no_file_of_text_is_refused(tmp_path):
    (tmp_path / "c.json").write_bytes(b"\xff\xfe\x00")
    for path, said in ((tmp_path / "c.json", "not UTF-8"), (tmp_path / "no.json", "no such file"),
                       (tmp_path, "a folder")):
        with pytest.raises(InputError, match=said) as error:
            read_config(path)
        assert str(error.value).startswith(str(path)) and "config" in str(error.value)


def test_a_mark_at_the_start_is_no_fault(tmp_path):
    (tmp_path / "c.json").write_text('\ufeff{"units": 32}', "utf-8")
    assert read_config(tmp_path / "c.json").settings.units == 32


# Numbers and texts of every kind under names that exist, and any JSON at all.
VALUES = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=9))
ANY = st.recursive(
    VALUES, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=9), inner, max_size=3)
)


@settings(max_examples=300, deadline=None)
@given(st.one_of(ANY, st.dictionaries(st.sampled_from(sorted(TrainingConfig().to_dict())), VALUES, max_size=4)))
def test_any_json_is_a_config_or_refused_in_one_line(told):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "c.json")
        path.write_text(json.dumps(told), "utf-8")
        try:
            config = read_config(path)
        except InputError as error:
            assert len(str(error).splitlines()) == 1 and str(error).startswith(str(path))
        else:
            assert build_config(config.to_dict()) == config
