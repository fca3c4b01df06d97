"""What `make bench` writes: earlier figures stay where a section fails, and nothing written by hand is lost."""

import re
from pathlib import Path

import pytest

from benchmarks import __main__ as bench

RESULTS = Path(bench.__file__).with_name("results.md")
BEFORE = """# Results

Old.

## Markers

Version 0.1.

| a |

### Notes

Old note.

## Throws and kicks

Kept.
"""


@pytest.fixture
def measure(tmp_path, monkeypatch):
    """Measure the markers, whose process returns `lines` or a failure, and return the text of the results."""
    out, notes = tmp_path / "results.md", tmp_path / "notes.md"
    out.write_text(BEFORE)
    notes.write_text("# Notes\n\n## Markers\n\nBy hand.\n")
    monkeypatch.setattr(bench, "NOTES", notes)
    monkeypatch.setattr(bench, "DATA", tmp_path)
    (tmp_path / "mocap").mkdir()

    def run(lines, failure):
        monkeypatch.setattr(bench, "measure_in_subprocess", lambda name, limit: (lines, failure))
        monkeypatch.setattr("sys.argv", ["benchmarks", "markers", "--out", str(out)])
        assert bench.main() == bool(failure)
        return out.read_text()

    return run


def test_new_figures_replace_old_ones_and_notes_stay_once(measure):
    text = measure(["| b |"], "")
    assert "| a |" not in text and "Old note." not in text and "Version 0.1." not in text
    assert "| b |\n\n### Notes\n\nBy hand.\n\n## Throws and kicks\n\nKept.\n" in text
    assert measure(["| b |"], "") == text


def test_a_section_that_fails_keeps_its_figures_and_says_so_once(measure):
    measure([], "the section takes longer than 9 s.")
    text = measure([], "the section failed.")
    assert text.count("Not measured again: ") == 1 and "failed. Version " in text
    assert "Version 0.1.\n\n| a |\n\n### Notes\n\nBy hand.\n" in text
    assert "Not measured again" not in measure(["| b |"], "")


def test_the_committed_results_have_the_notes_and_headings_of_the_code():
    parts, notes = bench.read_sections(RESULTS), bench.read_sections(bench.NOTES)
    headings = {f"## {title}" for title, _ in bench.SECTIONS.values()}
    assert set(notes) <= set(parts) <= headings and notes
    assert RESULTS.read_text("utf-8") == bench.format_results(parts, notes)


def test_the_list_of_modules_is_complete():
    folder = RESULTS.parent
    named = set(re.findall(r"`(\w+)`", (folder / "__init__.py").read_text("utf-8")))
    assert {path.stem for path in folder.glob("[a-z]*.py")} <= named
    used = {module for _, parts in bench.SECTIONS.values() for _, module, _ in parts}
    assert all((folder / f"{module}.py").is_file() for module in used)
