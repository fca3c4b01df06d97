"""Settings of rater studies."""
# fmt: off

from pathlib import Path

from .setting import Setting

TABLES = {
    "study.order": (
        Setting(name="raters", kind=int, least=1, most=1000, option="--raters", metavar="N",
                help="how many people rate", option_more=dict(required=True)),
        Setting(name="out", kind=Path, option="--out", metavar="FOLDER", help="a new or empty folder",
                option_more=dict(required=True)),
        Setting(name="seed", default=0, least=0, most=2**31 - 1, option="--seed",
                help="seed of the order of the clips"),
        Setting(name="pairs", default=False, option="--pairs", help="compare two clips at a time instead of rating "
                "each"),
        Setting(name="copy", default=False, option="--copy", help="copy movies under their neutral names"),
    ),
    "study.form": (Setting(name="embed", default=False, option="--embed", help="embed movies in the page: one file to "
                           "send"),),
    "study.analyse": (Setting(name="better", default=(), option="--better", help="a hypothesis: NEW looks more natural "
                              "than OLD; repeatable; default: the first system against all others",
                              option_more=dict(metavar=("NEW", "OLD"), action="append", nargs=2)),),
}
