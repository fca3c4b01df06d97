"""The verb `throw`: throws and kicks from trained networks. Each of its own verbs has a file."""

from __future__ import annotations

import argparse

from . import throw_evaluate, throw_examples, throw_synthesize, throw_train

OWN = (throw_train.add, throw_synthesize.add, throw_evaluate.add, throw_examples.add)
"""What adds a verb below `throw`; each gets the sub-parsers and returns its parser."""


def add(verbs):
    """The verb's parser, with those of its own verbs."""
    verb = verbs.add_parser("throw", help="throws and kicks from networks: train, synthesize, evaluate, examples")
    own = verb.add_subparsers(dest="throw_verb", required=True, metavar="VERB", parser_class=type(verb))
    for add_one in OWN:
        add_one(own).add_argument(
            "--json", action="store_true", default=argparse.SUPPRESS, help="progress as JSON lines on stderr",
        )
    return verb
