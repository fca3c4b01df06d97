"""What errors say of a damaged file is about the file, in plain words."""

import datetime

import numpy as np
import pytest

from beyond_mocap.base.errors import describe_damage

PLAIN = "values in other places, or of another kind, than expected"


@pytest.mark.parametrize("read, line", [
    (lambda value: value.get("a"), PLAIN), (lambda value: value["a"], PLAIN), (lambda value: [][value], PLAIN),
    (lambda value: int(value * np.inf), PLAIN), (lambda value: int(value * np.nan), PLAIN),
    (lambda value: np.array([[value], [value, value]], float), PLAIN),
    (lambda value: np.zeros(value).reshape(2, 2), PLAIN), (lambda value: np.concatenate([]), PLAIN),
    (lambda value: value / 0, PLAIN), (lambda value: {}["teams"], "no 'teams'"),
    (lambda value: float("wide"), "'wide' in the place of a number"),
    (lambda value: int("12,5"), "'12,5' in the place of a number"),
    (lambda value: datetime.datetime.fromisoformat("noon"), "'noon' in the place of a time"),
    (lambda value: datetime.datetime.strptime("1:2", "%H"), f"{PLAIN} (unconverted data remains: :2)"),
])  # fmt: skip
def test_words_of_python_are_replaced_and_words_about_the_file_stay(read, line):
    with pytest.raises(Exception) as raised:
        read(7)
    assert describe_damage(raised.value) == line
