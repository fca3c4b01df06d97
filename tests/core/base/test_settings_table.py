"""One table of settings: options are made from it, and those of version 0.1 are still there."""

import argparse
import math
from dataclasses import dataclass
from pathlib import Path

import pytest

from beyond_mocap.ball.physics import THROWN_BALLS
from beyond_mocap.base import settings
from beyond_mocap.base.errors import InputError
from beyond_mocap.base.settings import TABLES, find_setting
from beyond_mocap.base.settings.options import describe_ignored_options, name_options, option_values
from beyond_mocap.base.settings.setting import Setting, check_limits
from beyond_mocap.cli.main import build_parser
from beyond_mocap.motion.mass import SEGMENT_MASSES
from beyond_mocap.motion.momentum import STRENGTH
from beyond_mocap.path_editing.path_frame import FRAMES
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.search.blocks import SEARCH_MORE
from command_pages import iter_commands
from pages import SETTINGS_PAGE, build_settings_page

OPTIONS = Path(__file__).resolve().parents[2] / "data" / "options-0.1.txt"
PROBES = (
    "", "x", "nan", "-1", "0", "0.001", "0.3", "1", "1.5", "3", "12", "100", "500", "2000", "1e6", "1e10", "1,2,3",
)  # fmt: skip
SHARPNESS = Setting(
    name="sharpness", default=0.25, least=0.0, most=1.0, unit="turns", option="--sharpness", help="of corners",
    title="Sharpness", tooltip="How sharp corners are", in_preset=True,
)


def takes(action):
    """Which of PROBES an option takes, a letter each."""
    def fits(text):
        try:
            (action.type or str)(text)
        except (ValueError, argparse.ArgumentTypeError):
            return "-"
        return "+"
    return "".join(map(fits, PROBES))


def lines_of(top):
    """A line for each option: verb, flags, default as users see it, number of values, choices, what it takes."""
    for verb, own in (("", top), *iter_commands(top)):
        for action in own._actions:
            if not isinstance(action, argparse._SubParsersAction):
                switch = action.nargs == 0 and action.option_strings
                default = "off" if switch else action.default
                choices = " ".join(action.choices) if action.choices else ""
                names = " ".join(action.option_strings) or action.dest
                what = (verb, names, default, action.nargs, action.required, choices, "" if switch else takes(action))
                yield " | ".join(map(str, what))


def test_the_options_of_0_1_are_still_there():
    """tests/data/options-0.1.txt is never made again. A required option may have become optional, one file several,
    there are more methods, an empty name is refused where a file is named, and NaN where a time is.
    """
    now = set(lines_of(build_parser()))
    then = OPTIONS.read_text("utf-8").splitlines()
    assert len(then) > 200
    now |= {line.replace(" | False | ", " | True | ") for line in now}
    now |= {line.replace(" | path distance blocks fs baseline | ", " | path distance blocks | ") for line in now}
    now |= {line.replace(" | None | + | ", " | None | None | ") for line in now}
    now |= {line.replace(f" | -{'+' * (len(PROBES) - 1)}", f" | {'+' * len(PROBES)}") for line in now}  # "" is no file
    times = [line for line in now if " | --from | " in line or " | --to | " in line]
    now |= {line.replace(" | ---+", " | --++") for line in times}  # NaN is no time
    assert [line for line in then if line not in now] == []


@pytest.fixture
def with_sharpness(monkeypatch):
    """A setting more, in the table alone."""
    monkeypatch.setitem(TABLES, "synthesis", (*TABLES["synthesis"], SHARPNESS))
    return dict(iter_commands(build_parser()))["synthesize"]


FILES = ["--library", "L", "--track", "T", "--annotations", "A", "--out", "O"]


def test_a_row_is_an_option_with_its_default_and_limits(with_sharpness):
    @dataclass
    class Corners:
        sharpness: float

    assert with_sharpness.parse_args(FILES).sharpness == 0.25
    options = with_sharpness.parse_args([*FILES, "--sharpness", "0.5"])
    assert option_values(Corners, options, "synthesis") == {"sharpness": 0.5}
    with pytest.raises(InputError, match="'1.5' is not 0 to 1 turns"):
        with_sharpness.parse_args([*FILES, "--sharpness", "1.5"])
    with pytest.raises(InputError, match="^sharpness: "):
        check_limits(Corners(2.0), settings.list_settings("synthesis"))


@pytest.mark.parametrize("line, group, named", [
    ("the floor is at +0.8 m; use Floor at 0 to move it", "markers", "the floor is at +0.8 m; use --floor to move it"),
    ("toes slide 30 mm: use Plant Feet", "markers", "toes slide 30 mm: leave out --no-plant"),
    (SEARCH_MORE, "synthesis", "a higher --max-blocks compares more and takes longer"),
    ("the floor and Plant Feet", "markers", "the floor and Plant Feet"),
])
def test_messages_name_settings_as_the_command_line_does(line, group, named):
    assert name_options(line, group) == named


@pytest.mark.parametrize("line, ignored", [
    ("--method path --max-blocks 50 --delta 3 --catch-up-window 1 --watch 0", ["--delta", "--catch-up-window",
                                                                               "--max-blocks"]),
    ("--method fs --no-catch-up --max-blocks 50", ["--no-catch-up"]),
    ("--method distance --no-catch-up --max-blocks 50 --no-made --strength 3", ["--no-made", "--strength"]),
    ("--method baseline --delta 0.5 --strong-foot left", ["--strong-foot"]), ("", []),
])
def test_options_that_the_method_ignores_are_named(line, ignored):
    options = build_parser().parse_args(["synthesize", *FILES, *line.split()])
    lines = describe_ignored_options(options, "synthesis", "player")
    assert [one.split(":")[0] for one in lines] == ignored
    assert all(f"the method {options.method} does not use it; ignored; use it with " in one for one in lines)


def test_a_row_is_on_the_page_of_settings(with_sharpness):
    line = "- **Sharpness**, `sharpness`, `--sharpness`: How sharp corners are. Default: 0.25. 0 to 1 turns."
    assert line in build_settings_page()


def test_the_page_of_settings_is_up_to_date():
    assert SETTINGS_PAGE.read_text("utf-8") == build_settings_page(), "run python packaging/pages.py"


def test_every_row_makes_sense():
    for group, rows in TABLES.items():
        assert len({row.name for row in rows}) == len(rows), group
    for group, row in ((group, row) for group, rows in TABLES.items() for row in rows):
        where = f"{group} {row.name}"
        assert row.option or row.tooltip or row.help, where
        assert not row.option.startswith("--no-") or row.default is True, where
        assert not row.choices or row.default in (None, *row.choice_names), where
        if row.least is not None and row.most is not None:
            assert row.least < row.most and math.isfinite(row.most), where


def test_what_the_table_names_is_what_the_core_knows():
    """The base cannot import them."""
    assert find_setting("markers", "ball").choice_names == tuple(THROWN_BALLS)
    assert find_setting("path_editing", "frame").choice_names == FRAMES
    assert find_setting("player", "strength").default == STRENGTH
    assert find_setting("player", "masses").choice_names == tuple(SEGMENT_MASSES)
    assert {row.name for row in TABLES["synthesis"]} <= set(Plan.__dataclass_fields__)


def test_what_updates_by_itself_has_one_name():
    titles = [row.title for rows in TABLES.values() for row in rows if row.name == "live"]
    assert len(titles) == 5 and set(titles) == {"Update Automatically"}
