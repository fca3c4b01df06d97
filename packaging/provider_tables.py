"""Writes the tables of providers in docs/match/match-input.md from their records: python
packaging/provider_tables.py"""

import pathlib
import re
import sys

TOP = pathlib.Path(__file__).resolve().parent.parent
PAGE = TOP / "docs" / "match" / "match-input.md"


def with_tables(text):
    """The page with the rows of both tables, in their order, as the records have them."""
    from beyond_mocap.files.event_providers import EVENT_PROVIDERS
    from beyond_mocap.files.tracking.providers import PROVIDERS

    tables = iter((PROVIDERS, EVENT_PROVIDERS))

    def rows(head):
        return head[1] + "".join(f"| {one.title} | {one.files} |\n" for one in next(tables).values())

    return re.sub(r"(?m)^(\| provider \|.*\n\|-.*\n)(?:\|.*\n)*", rows, text)


if __name__ == "__main__":
    sys.path.insert(0, str(TOP))
    PAGE.write_text(with_tables(PAGE.read_text("utf-8")), "utf-8")
