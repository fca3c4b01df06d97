"""The pages of commands and labels are those of the program."""

from beyond_mocap.annotation.labels import read_labels
from beyond_mocap.cli.main import build_parser
from command_pages import build_commands_page, build_labels_page
from pages import COMMANDS_PAGE, LABELS_PAGE


def test_the_page_of_commands_is_up_to_date():
    assert COMMANDS_PAGE.read_text("utf-8") == build_commands_page(build_parser()), "run python packaging/pages.py"


def test_the_page_of_labels_is_up_to_date_and_has_every_label():
    labels = read_labels()
    page = LABELS_PAGE.read_text("utf-8")
    assert page == build_labels_page(labels.values()), "run python packaging/pages.py"
    assert all(f"| `{name}` | {label.title} |" in page for name, label in labels.items())
