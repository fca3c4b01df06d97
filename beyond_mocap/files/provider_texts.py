"""Names, titles and files of the providers, for lists of an interface, which need nothing of how the files are read."""

from __future__ import annotations

from typing import TypedDict


class ProviderTexts(TypedDict):
    """The first fields of a `Provider`."""

    name: str
    title: str
    files: str


def _build_texts(name: str, title: str, files: str) -> tuple[str, ProviderTexts]:
    return name, {"name": name, "title": title, "files": files}


# saved scenes store the position in these orders: add new providers at the end, with their records
TRACKING: dict[str, ProviderTexts] = dict((
    _build_texts("tracab", "TRACAB", "`.dat` or `.json`, metadata `.xml` or `.json`; referees too"),
    _build_texts("metrica", "Metrica", "CSV, a file per team; or EPTS text with its XML"),
    _build_texts("skillcorner", "SkillCorner", "`.json` or `.jsonl` with the match's JSON"),
    _build_texts("sportec", "Sportec (DFL)",
                 "positions XML with the match information XML; referees, colours of shirts"),
    _build_texts("secondspectrum", "Second Spectrum",
                 "`.jsonl` with its XML (a JSON of the same name brings names), or with its JSON"),
    _build_texts("statsperform", "Stats Perform", "MA25 text with MA1"),
    _build_texts("pff", "PFF",
                 "`.jsonl`, metadata, and the roster (in the same folder, or in one with `roster` in its name); "
                 "colours of shirts"),
    _build_texts("signality", "Signality",
                 "`..p1...json` (the other half is found by its name), metadata, and the file with `venue` in its "
                 "name; referees"),
    _build_texts("hawkeye", "HawkEye",
                 "any file of a folder: all its `.samples.centroids` and `.samples.ball` are used; metadata if "
                 "there is any"),
    _build_texts("cdf", "Common Data Format", "`tracking.jsonl` with its metadata"),
    _build_texts("respovision", "ReSpo.Vision", "`.jsonl`"),
    _build_texts("soccernet", "SoccerNet Game State", "`Labels-GameState.json`, or predictions of its form"),
    _build_texts("gps", "GPS",
                 "CSV with latitude, longitude and time (Catapult, STATSports) or GPX, a file for each player; "
                 "the pitch's corners in `..corners.csv`"),
    _build_texts("table", "Plain CSV", "one CSV with `time_s,player,x_m,y_m`, a row for each player and moment"),
))
EVENTS: dict[str, ProviderTexts] = dict((
    _build_texts("opta", "Opta", "F24 or F73 with F7"),
    _build_texts("sportec", "Sportec (DFL)", "events with the tracking's metadata"),
    _build_texts("statsbomb", "StatsBomb", "events with their lineups"),
    _build_texts("metrica", "Metrica", "events with the tracking's metadata; CSV alone"),
    _build_texts("wyscout", "Wyscout", "alone (2 and 3)"),
    _build_texts("datafactory", "DataFactory", "alone"),
    _build_texts("statsperform", "Stats Perform", "MA3 with MA1"),
    _build_texts("impect", "Impect", "events with their lineups"),
    _build_texts("csv", "CSV",
                 "`time_s,type,player[,detail,success,x,y,period,part,side]`, seconds of the match, or of the "
                 "period where a column names it"),
))
