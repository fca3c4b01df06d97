"""Write the reference pages of commands and labels from the parser and the vocabulary, for `pages.py`."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from beyond_mocap.annotation.labels import Label

COMMANDS_HEAD = """# Commands

*For all who use the command line, batch jobs or farms: every command with its options. This page is generated from the
program by `make tables`.*

The same commands run as `python -m beyond_mocap COMMAND`, as `blender --command beyond_mocap COMMAND`, and on farms as
`blender -b FILE --python batch.py -- COMMAND`. Inside Blender, `--out` (of `match`: `--scene`) may also end
with `.blend`, `.fbx`, `.glb` or `.usdc`; `mirror` writes BVH only, `retarget` BVH and SMPL's `.npz`.

Exit status: 0 done; 2 the command line or an input is wrong; 3 the library lacks what was asked for; 130 cancelled; 141
the reader of the output ended, as `head` does. An error is one line: where, what was found, what was expected, what to
do.
"""
LABELS_HEAD = """# Labels

*For all who annotate clips or matches: every label of the vocabulary. This page is generated from
`beyond_mocap/annotation/vocabulary.csv` by `make tables`.*

A text file has the short form, panels show the name. How labels combine is [explained here](../explanation/labels.md);
how they are written is in [the text form](annotation-text.md). A library may add labels of its own. Faustino's thesis
lists most of these labels without explaining them; the meanings are our reading.

`transition` is no label of the vocabulary: alone in a line with two times, it asks for nothing, and continuity decides
what the player does. With nearest labels (`--nearest`), the action itself may change; a reception never becomes a kick.
"""
TABLE_HEAD = "| short form | name | meaning | goes with |\n| --- | --- | --- | --- |"
KINDS = {
    "continuous": ("Spans", "What a player does for a while."),
    "discrete": ("Key moments", "What happens at one instant."),
    "modifier": ("Details", "They stand beside another label and make it more precise."),
    "": ("Other labels", "They stand below the labels above."),
    "recordings": ("Labels of recordings", "Annotations of recordings use them. A player has one only where a "
                   "clip of the library\nhas it, apart from `-touch`."),
}


def build_commands_page(parser: argparse.ArgumentParser) -> str:
    """Build the page of all commands.

    Args:
        parser: the parser of the command line.
    Returns:
        The page as Markdown.
    """
    parts = [COMMANDS_HEAD]
    for name, command in iter_commands(parser):
        if command._subparsers is not None:
            continue
        parts.append(f"\n## {name}\n\n{_describe(command)}")
        parts.append(f"\n```text\n{_format_usage(command)}\n```\n")
        parts.extend(f"\n- {line}" if i == 0 else f"- {line}" for i, line in enumerate(_list_options(command)))
    return "\n".join(part.rstrip("\n") for part in parts) + "\n"


def iter_commands(parser: argparse.ArgumentParser, prefix: str = "") -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Go through all commands, each before the commands below it.

    Args:
        parser: a parser.
        prefix: the words before the command's name.
    Returns:
        Names and parsers, in the order of the help.
    """
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, command in action.choices.items():
                command.description = command.description or _find_help(action, name)
                yield prefix + name, command
                yield from iter_commands(command, f"{prefix}{name} ")


def build_labels_page(labels: Iterable[Label]) -> str:
    """Build the page of all labels.

    Args:
        labels: the vocabulary's labels, as `read_labels` gives them.
    Returns:
        The page as Markdown.
    """
    parts = [LABELS_HEAD]
    rows = list(labels)
    for kind, (title, text) in KINDS.items():
        parts.append(f"\n## {title}\n\n{text}\n\n{TABLE_HEAD}")
        parts.extend(_format_label(label) for label in rows if kind in _list_kinds(label))
    return "\n".join(part.rstrip("\n") for part in parts) + "\n"


def _list_kinds(label: Label) -> tuple[str, ...]:
    """List the tables of `KINDS` that show a label."""
    from beyond_mocap.annotation import list_vocabulary

    return label.kinds or ("" if label.name in list_vocabulary() else "recordings",)


def _format_label(label: Label) -> str:
    below = " ".join(f"`{name}`" for name in dict.fromkeys(_iter_below(label.below or {})))
    return f"| `{label.name}` | {label.title} | {label.meaning} | {below} |"


def _iter_below(tree: dict[str, dict]) -> Iterator[str]:
    """Go through the labels of a tree, each before those below it."""
    for name, branch in tree.items():
        yield name
        yield from _iter_below(branch)


def _find_help(action: argparse._SubParsersAction, name: str) -> str:
    return next((choice.help or "" for choice in action._choices_actions if choice.dest == name), "")


def _describe(command: argparse.ArgumentParser) -> str:
    text = " ".join((command.description or "").split())
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") or not text else ".")


def _format_usage(command: argparse.ArgumentParser) -> str:
    required = [action for action in command._actions if action.option_strings and action.required]
    positional = [action for action in command._actions if not action.option_strings]
    words = [_format_action(action) for action in positional + required]
    return " ".join([command.prog, *words, "[options]"])


def _format_action(action: argparse.Action) -> str:
    """One argument as it is typed."""
    name = max(action.option_strings, key=len, default="")
    if action.nargs == 0:
        return name
    value = action.metavar or ("|".join(map(str, action.choices)) if action.choices else action.dest.upper())
    value = " ".join(value) if isinstance(value, tuple) else str(value)
    return " ".join(filter(None, (name, value + (" ..." if action.nargs in ("+", "*") else ""))))


def _list_options(command: argparse.ArgumentParser) -> list[str]:
    lines = []
    for action in command._actions:
        if action.help == argparse.SUPPRESS or isinstance(action, argparse._HelpAction):
            continue
        text = " ".join((action.help or "").split())
        text = text % {"default": action.default, "prog": command.prog} if "%(" in text else text.replace("%%", "%")
        lines.append(f"`{_format_action(action)}`" + (f": {text}" if text else ""))
    return lines
