"""Passing scenes to begin with, in the form of SCENE.json (docs/passes/passes.md): three and six players as in Fig. 7
and 8, foot volleyball over a net, a rally with racquets, and a ball that is dropped."""

from __future__ import annotations

SAMPLES: dict[str, dict] = {
    "three": {
        "players": [
            {"name": "Ann", "place": [0.0, 3.2]},
            {"name": "Ben", "place": [-2.8, -1.6]},
            {"name": "Cho", "place": [2.8, -1.6]},
        ],
        "passes": [
            {"from": "Ann", "to": "Ben", "kind": "pass"},
            {"from": "Ben", "to": "Cho", "kind": "toss"},
            {"from": "Cho", "to": "Ann", "kind": "attack"},
        ],
        "repeat": 3,
        "seed": 3,
    },
    "six": {
        "players": [
            {"name": "Ann", "place": [4.2, 0.0]},
            {"name": "Ben", "place": [2.1, 3.7]},
            {"name": "Cho", "place": [-2.1, 3.7]},
            {"name": "Dia", "place": [-4.2, 0.0]},
            {"name": "Eli", "place": [-2.1, -3.7]},
            {"name": "Fay", "place": [2.1, -3.7]},
        ],
        "passes": [
            {"from": "Ann", "to": "Cho", "kind": "pass"},
            {"from": "Cho", "to": "Dia", "kind": "toss"},
            {"from": "Dia", "to": "Fay", "kind": "attack"},
            {"from": "Fay", "to": "Ben", "kind": "pass"},
            {"from": "Ben", "to": "Eli", "kind": "pass"},
            {"from": "Eli", "to": "Ann", "kind": "pass"},
        ],
        "repeat": 2,
    },
    "volley_net": {
        "players": [
            {"name": "Ann", "place": [-2.2, 1.6]},
            {"name": "Ben", "place": [-4.0, -1.6], "part": "head"},
            {"name": "Cho", "place": [2.4, -1.4]},
            {"name": "Dia", "place": [4.2, 1.8]},
        ],
        "passes": [
            {"from": "Ann", "to": "Ben", "kind": "toss"},
            {"from": "Ben", "to": "Cho", "kind": "pass"},
            {"from": "Cho", "to": "Dia", "kind": "toss"},
            {"from": "Dia", "to": "Ann", "kind": "attack"},
        ],
        "defaults": {"bounces": 0},
        "repeat": 2,
        "ball": "volleyball",
        "net": {"from": [0.0, -4.5], "to": [0.0, 4.5], "height": 1.5},
    },
    "racquet": {
        "players": [
            {"name": "Ann", "place": [-6.5, 0.6], "part": "tool", "side": "right"},
            {"name": "Ben", "place": [6.5, -0.6], "part": "tool", "side": "right"},
        ],
        "passes": [
            {"from": "Ann", "to": "Ben"},
            {"from": "Ben", "to": "Ann"},
        ],
        "repeat": 3,
        "ball": "tennis",
        "net": {"from": [0.0, -5.0], "to": [0.0, 5.0], "height": 0.95},
        "serve": "Ben",
    },
    "dropped": {
        "players": [
            {"name": "Ann", "place": [0.0, 3.2]},
            {"name": "Ben", "place": [-2.8, -1.6]},
            {"name": "Cho", "place": [2.8, -1.6]},
        ],
        "passes": [
            {"from": "Ann", "to": "Ben"},
            {"from": "Ben", "to": "Cho"},
            {"from": "Cho", "to": "Ann"},
            {"from": "Ann", "to": "Ben", "error": "dropped"},
        ],
        "lead_out": 2.5,
    },
}
