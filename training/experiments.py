"""Experiments with networks of throws and kicks, row by row within a limit of time: `make experiments`.

    python -m training.experiments --data FOLDER --out FOLDER --hours H [--row NAME ...]

Each row of the file of experiments is a training on the same recordings, tested on other people. All rows that are not
complete get an equal share of the time. The command can be stopped at any moment: repeated, it continues each row from
its last checkpoint, to the same bits. Beside the checkpoints it writes a report of each row, ROW.json, and the table
`experiments.md` of what was reached and what is missing.
Source: Fredriksson sections 7.6, 8.3, 9.3, 9.4.
"""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from beyond_mocap.base.content import read_utf8
from beyond_mocap.base.errors import BeyondMocapError, InputError, UserCancelledError
from beyond_mocap.base.optional_packages import import_optional
from beyond_mocap.cli.main import OneLineParser
from beyond_mocap.cli.outputs import ProgressReporter
from beyond_mocap.cli.throwing import read_test_examples, select_subjects
from beyond_mocap.files import json_values as values
from beyond_mocap.files.atomic import atomic_write
from beyond_mocap.files.tables import write_report
from beyond_mocap.throws.evaluate_throws import FULL_OPTIONS, RAW_OPTIONS, evaluate_throws
from beyond_mocap.throws.networks.example import Example
from beyond_mocap.throws.networks.model import ThrowModel

from .config import MAX_FILE_SIZE, PAGE, TrainingConfig, build_config
from .experiment_table import RowResult, build_table

EXPERIMENTS = Path(__file__).with_name("experiments.json")
TABLE = "experiments.md"
_NAMES = ("action", "training", "tests", "rows")
_REPORTED = ("row", "config", "trained_on", "epochs", "seconds", "losses", "tests")
_OPTIONS = {"alone": RAW_OPTIONS, "corrected": FULL_OPTIONS}


@dataclass(frozen=True)
class Source:
    """Recordings of people. folder: below the data; subjects: their names, all if empty."""

    folder: str
    subjects: tuple[str, ...]


@dataclass(frozen=True)
class Row:
    """A training. title: what it is; config: its configuration."""

    title: str
    config: TrainingConfig


@dataclass(frozen=True)
class Experiments:
    """Contents of a file of experiments.

    Attributes:
        training: recordings that all rows are trained on.
        tests: recordings that they are tested on, by name.
        rows: trainings by name.
    """

    training: Source
    tests: Mapping[str, Source]
    rows: Mapping[str, Row]


def read_experiments(path: Path) -> Experiments:
    """Read a file of experiments; InputError, one line, if it is none."""
    entries = values.parse_json(read_utf8(path, "experiments", MAX_FILE_SIZE), str(path), PAGE)
    values.check_names(entries, str(path), _NAMES, _NAMES)
    action = values.check_text(entries["action"], f"{path}: action")
    for name in ("tests", "rows"):
        values.check_object(entries[name], f"{path}: {name}")
    rows = {name: _parse_row(name, row, action, f"{path}: {name}") for name, row in entries["rows"].items()}
    tests = {name: _parse_source(source, f"{path}: {name}") for name, source in entries["tests"].items()}
    return Experiments(_parse_source(entries["training"], f"{path}: training"), tests, rows)


def _parse_row(name: str, entry, action: str, where: str) -> Row:
    """Parse a row; its name becomes that of files."""
    if not re.fullmatch(r"[a-z0-9-]+", name):
        raise InputError(where, values.describe_value(name), "small letters, digits and hyphens")
    values.check_names(entry, where, ("title", "config"), ("title", "config"))
    values.check_object(entry["config"], f"{where}: config")
    config = build_config({"action": action, **entry["config"]}, where)
    return Row(values.check_text(entry["title"], where), config)


def _parse_source(entry, where: str) -> Source:
    """Parse recordings of people."""
    values.check_names(entry, where, ("folder", "subjects"), ("folder", "subjects"))
    return Source(values.check_text(entry["folder"], where), values.check_texts(entry["subjects"], where))


class Runner:
    """Runs rows in a folder."""

    def __init__(self, experiments: Experiments, data: Path, out: Path, reporter: ProgressReporter):
        """Prepare a run.

        Args:
            experiments: what to run.
            data: folder of the recordings.
            out: folder of the results.
            reporter: receives notes and progress.
        """
        self.experiments, self.data, self.out, self.reporter = experiments, data, out, reporter

    def run_rows(self, names: Sequence[str], seconds: float) -> None:
        """Run rows until the time is over; the table is written after each.

        Args:
            names: names of the rows, in this order; those that are complete are not run again.
            seconds: time for all of them; each trains at least one macro-epoch.
        """
        end = time.monotonic() + seconds
        waiting = [name for name in names if not self.read_result(name).is_complete]
        self.write_table()
        for number, name in enumerate(waiting):
            now = time.monotonic()
            self.run_row(name, now + (end - now) / (len(waiting) - number))
            self.write_table()

    def run_row(self, name: str, deadline: float) -> None:
        """Train a row until it is complete or `deadline` (s, `time.monotonic`) has passed, and test it."""
        from .fit import read_progress
        from .train import train

        config = self.experiments.rows[name].config
        examples = self._read_training(config)
        checkpoint = self._checkpoint(name)
        model = train(
            examples, config, checkpoint=checkpoint, resume=checkpoint.exists(),
            is_done=lambda epoch: time.monotonic() >= deadline,
            progress=lambda share, text: self.reporter.show_progress(share, f"{name}: {text}"),
        )
        reached = read_progress(checkpoint)
        write_report(self._report(name), {
            "row": name, "config": config.to_dict(), "trained_on": model.trained_on, "epochs": reached.epoch,
            "seconds": reached.seconds, "losses": reached.losses,
            "tests": {test: self.test_model(model, source) for test, source in self.experiments.tests.items()},
        })  # fmt: skip

    def test_model(self, model: ThrowModel, source: Source) -> dict:
        """Evaluate a model on people, the networks alone and corrected."""
        folder = self.data / source.folder
        examples = select_subjects(read_test_examples(folder, model, self.reporter), source.subjects, folder)
        with np.errstate(all="ignore"):  # networks that are hardly trained overflow; such a body is counted as lost
            return {name: {**evaluate_throws(model, examples, options).build_report(), "requested": len(examples)}
                    for name, options in _OPTIONS.items()}

    def read_result(self, name: str) -> RowResult:
        """Read what was reached of a row.

        Args:
            name: name of the row.
        Returns:
            Its result, without figures where it was not tested yet.
        Raises:
            InputError: if it was run with another configuration, or its files are damaged.
        """
        from .fit import read_progress

        row, path, checkpoint = self.experiments.rows[name], self._report(name), self._checkpoint(name)
        reached = read_progress(checkpoint).epoch if checkpoint.exists() else None
        report = _read_report(path) if path.exists() else None
        if report is not None and report["config"] != row.config.to_dict():
            raise InputError(path, "belongs to a row of other settings", "", "choose another folder for these")
        return RowResult(row.title, row.config.epochs, reached, report)

    def write_table(self) -> None:
        """Write the table of all rows."""
        results = [self.read_result(name) for name in self.experiments.rows]
        atomic_write(self.out / TABLE, build_table(results, tuple(self.experiments.tests)))

    def _read_training(self, config: TrainingConfig) -> list[Example]:
        """Read the recordings that rows are trained on."""
        from .train import read_training_examples

        source = self.experiments.training
        return read_training_examples(self.data / source.folder, config, source.subjects, None, self.reporter)

    def _checkpoint(self, name: str) -> Path:
        return self.out / f"{name}.checkpoint.npz"

    def _report(self, name: str) -> Path:
        return self.out / f"{name}.json"


def _read_report(path: Path) -> dict:
    """Read the report of a row; InputError if it is none."""
    report = values.parse_json(read_utf8(path, "a row's report", MAX_FILE_SIZE), str(path), PAGE)
    values.check_names(report, str(path), _REPORTED, _REPORTED)
    return report


def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status: 0 done or skipped, 2 an input is wrong, 130 stopped."""
    try:
        return _run(_build_parser().parse_args(argv))
    except BeyondMocapError as error:
        print(f"experiments: {error}", file=sys.stderr)
        return error.exit_status
    except OSError as error:
        print(f"experiments: {error.filename}: {error.strerror}; choose a folder that can be written", file=sys.stderr)
        return InputError.exit_status
    except KeyboardInterrupt:
        print("experiments: stopped; the same command continues", file=sys.stderr)
        return UserCancelledError.exit_status


def _build_parser() -> OneLineParser:
    parser = OneLineParser(prog="experiments", description="Experiments with networks of throws and kicks.")
    parser.add_argument("--experiments", type=Path, default=EXPERIMENTS, help="JSON file of the rows")
    parser.add_argument("--data", type=Path, required=True, help="folder of the recordings")
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--hours", type=float, required=True, help="clock time for all rows that are not complete")
    parser.add_argument("--row", action="append", default=[], help="a row; may be repeated; all without")
    return parser


def _run(options) -> int:
    """Check the options and run the rows."""
    experiments = read_experiments(options.experiments)
    for name in options.row:
        if name not in experiments.rows:
            raise InputError("--row", name, f"one of {', '.join(experiments.rows)}", f"see {options.experiments}")
    if not 0.0 <= options.hours <= 1000.0:
        raise InputError("--hours", f"{options.hours:g}", "0 to 1000")
    missing = [source.folder for source in (experiments.training, *experiments.tests.values())
               if not (options.data / source.folder).is_dir()]
    if missing:
        print(f"experiments: skipped, {options.data} has no folder {missing[0]}")
        return 0
    import_optional("jax", "training")  # .fit and .train need it, --help does not
    options.out.mkdir(parents=True, exist_ok=True)
    reporter = ProgressReporter(False)
    Runner(experiments, options.data, options.out, reporter).run_rows(options.row or list(experiments.rows),
                                                                       3600.0 * options.hours)
    reporter.finish()
    print(f"{options.out / TABLE}: written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
