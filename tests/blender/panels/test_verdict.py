"""The one line about a take: its word follows the figures, and its places are what can be pressed."""

import importlib

import pytest

MET = "\n".join(f"Figure {number}: 1.0 cm\t≤ 2.0\tmet" for number in range(20))


@pytest.fixture
def judge(extension):
    return importlib.import_module(f"{extension.__name__}.panels.verdict").judge_take


@pytest.mark.parametrize("more, word", [
    ("", "Good"),
    ("Cuts: 36 /min\t≤ 30\tmissed", "Good"),  # one of 21, and not seen at once
    ("Foot slide: 3.5 cm/s\t≤ 3.2\tmissed", "Fair"),
    ("Foot slide: 4.9 cm/s\t≤ 3.2\tmissed", "Poor"),
    ("Lowest point: -6.0 mm\t≥ -5.0\tmissed", "Fair"),
    ("Lowest point: -9.0 mm\t≥ -5.0\tmissed", "Poor"),
    *((f"{name}: {value}\t≤ {target}\tmissed", word) for name, target, fair, poor in (
        ("Rough transitions", "10", "41 %", "89 %"), ("Worst transition", "1.30", "2.99 x", "4.78 x"),
        ("Unusual poses", "10.0", "12.0 %", "100.0 %"), ("Jolts", "1.0", "6.0 /min", "24.9 /min"),
        ("Pelvis drops", "0.6", "4.2 /min", "12.0 /min"), ("Snap turns", "0.6", "3.0 /min", "12.0 /min"),
        ("Spins not asked for", "0.0", "1.5 /min", "3.0 /min"), ("Second strikes", "0", "1", "2"),
        ("Feet out of reach", "0.0", "0.4 %", "6.0 %"), ("Ball inside the body", "0", "2 frames", "12 frames"),
    ) for value, word in ((fair, "Fair"), (poor, "Poor"))),
    ("Jolts: 15.0 /min\t≤ 1.0\tmissed\t1", "Fair"),  # in 4 s: one event is no rate, and still no good take
    ("Jolts: 30.0 /min\t≤ 1.0\tmissed\t2", "Poor"),
    ("Jolts: 6.0 /min\t≤ 1.0\tmissed\t4", "Fair"),
    ("\n".join(f"Other {number}: 6\t≤ 1\tmissed" for number in range(3)), "Fair"),
    ("\n".join(f"Other {number}: 6\t≤ 1\tmissed" for number in range(21)), "Poor"),
    ("Computing time: 1.7 s\t\t", "Good"),
])
def test_the_word_follows_the_figures(judge, more, word):
    found = judge(f"{MET}\n{more}", "", "")
    assert found.word == word and found.line == word


def test_a_missed_key_moment_is_poor_and_a_place(judge):
    found = judge(MET, "8.5 s  kick, +0.30 s\t8.500\tmissed\n9.0 s  kick\t9.000\tmet", "")
    assert found.line == "Poor. 1 place to look at"
    assert found.places == (("8.5 s  kick, +0.30 s", "8.500", True),)


def test_warnings_with_a_time_are_places(judge):
    found = judge(MET, "", "2.0 s: a\t2.000\n3.0, 4.0 s: b\t3.000 4.000\nno time\t")
    assert found.line == "Good. 2 places to look at" and (found.met, found.judged) == (20, 20)
    assert [seconds for _, seconds, _ in found.places] == ["2.000", "3.000 4.000"]


def test_without_figures_nothing_is_said(judge):
    assert judge("", "", "").line == "" == judge("Computing time: 1.7 s", "", "5.0 s: a\t5.000").word
