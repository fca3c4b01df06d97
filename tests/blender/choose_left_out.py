"""Chooses the tests that the older Blender leaves out where `make test` runs two, into left_out.txt: `make left-out`.

A pytest plugin that notes which lines of scene/, operators/ and panels/ each test reaches, and how long it takes. A
slow test is left out, the slowest first, where the tests that stay still reach each of its lines, and where in its
folder they still have each text that one of its cases is about (formats, modes, operators) and press each operator of
Blender that it presses. Quick tests stay, and those of undo, of saved and opened files and of linked data, which
Blender does itself, and all of test_every_operator.py. The list names what is left out, so that a new test runs in both
Blenders until the list is made again.
"""

import inspect
import os
import pathlib
import re
from collections import Counter, defaultdict

import coverage
import pytest

HERE = pathlib.Path(__file__).resolve().parent
LIST = HERE / "left_out.txt"
WHOLE = "test_every_operator.py"
DONE_BY_BLENDER = re.compile(r"undo|one_step|_mainfile|libraries\.|override")
SLOW = 0.2  # s of processor time

seconds: Counter = Counter()
reached: dict[str, set] = defaultdict(set)
"""Test -> (file, line) of the product, and (folder, text) of cases and of operators of Blender."""
cover = coverage.Coverage(data_file=None, config_file=False,
                          include=[f"{HERE.parents[1] / name}/*" for name in ("scene", "operators", "panels")])
cover.start()


class SharedWork:
    """What fixtures of several tests have taken so far, which is no test's own."""

    seconds = 0.0


def read_clock() -> float:
    """Seconds of processor time of this process and its children so far."""
    return sum(os.times()[:4])


@pytest.hookimpl(hookwrapper=True, tryfirst=True)
def pytest_runtest_protocol(item):
    start = read_clock() - SharedWork.seconds
    cases = getattr(item, "callspec", None)
    texts = [value for value in cases.params.values() if isinstance(value, str)] if cases else []
    texts += re.findall(r"bpy\.ops\.(?!beyond_mocap)(\w+\.\w+)", inspect.getsource(item.function))
    reached[item.nodeid] |= {(str(item.path.parent), text) for text in texts}
    cover.switch_context(item.nodeid)
    yield
    cover.switch_context("")
    seconds[item.nodeid] += read_clock() - SharedWork.seconds - start


@pytest.hookimpl(hookwrapper=True)
def pytest_fixture_setup(fixturedef):
    before, start = SharedWork.seconds, read_clock()
    yield
    if fixturedef.scope != "function":
        SharedWork.seconds = before + read_clock() - start  # those within it are counted once


def pytest_sessionfinish(session, exitstatus):
    cover.stop()
    if exitstatus != 0:
        return
    data = cover.get_data()
    for file in data.measured_files():
        for line, names in data.contexts_by_lineno(file).items():
            for name in {*names} & {*seconds}:
                reached[name].add((file, line))
    may_go = {item.nodeid for item in session.items if seconds[item.nodeid] >= SLOW
              and not item.nodeid.startswith(WHOLE) and not DONE_BY_BLENDER.search(inspect.getsource(item.function))}
    LIST.write_text("".join(f"{name}\n" for name in choose_left_out(may_go)))


def choose_left_out(may_go: set[str]) -> list[str]:
    """The tests of those that may go that are left out."""
    count, left_out = Counter(one for found in reached.values() for one in found), []
    for name in sorted(may_go, key=lambda name: -seconds[name]):
        if all(count[one] > 1 for one in reached[name]):
            left_out.append(name)
            count.subtract(reached[name])
    return sorted(left_out)
