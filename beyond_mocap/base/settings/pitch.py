"""Settings of the pitch."""
# fmt: off

from .setting import Setting

SPORTS = (
    ("football", "Football", "105 x 68 m"), ("futsal", "Futsal", "40 x 20 m"), ("handball", "Handball", "40 x 20 m"),
    ("basketball", "Basketball", "28 x 15 m"), ("ice_hockey", "Ice Hockey", "60 x 30 m"),
    ("field_hockey", "Field Hockey", "91.4 x 55 m"), ("rugby", "Rugby", "100 x 70 m between the goal lines"),
    ("american_football", "American Football", "91.44 x 48.77 m between the goal lines"),
)

TABLES = {
    "pitch": (
        Setting(name="sport", default="football", choices=SPORTS, option="--sport", help="whose pitch it is; touches of "
                "the ball are found in football only", tooltip="Whose pitch, lines, goals and ball are shown"),
    ),
}
