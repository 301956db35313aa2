"""The paper's preference study: which of several simulations looks most real.

Part one shows a clip four times, simulated in four ways; part two twice, with fitted parameters and without (Wang,
Yang, Zhao, Yang and Shen, Realistic surgical simulation from monocular videos, supplement). Which method made a film is
in the key alone: the page names none.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from surgisim.config.study import PARTS
from surgisim.problem import Problem
from surgisim.report.uri import data_uri
from surgisim.video import mp4

FORMAT, KEY = "surgisim-study/1", "surgisim-study-key/1"
GROUPS = ("surgeon", "other")


def study(
    films: Mapping[tuple[str, str], bytes], recordings: Mapping[str, tuple[np.ndarray, float]], seed: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the page is made of, and the key to its answers.

    films: (clip, variant) -> mp4; recordings: clip -> frames, sRGB (T, H, W, 3) uint8, and frames per second. Raises
    Problem where a film of a part is missing.
    """
    asked = [(part, clip, variants) for part, variants in PARTS.items() for clip in recordings]
    missing = [f"{c}/{v}" for _, c, variants in asked for v in variants if (c, v) not in films]
    if missing:
        raise Problem(f"study: no film of {', '.join(missing)}. Simulate them, or leave their clips out.")
    names = {pair: _name(seed, *pair) for pair in films}
    sets = [
        {
            "set": _name(seed, part, clip),
            "part": part,
            "clip": _name(seed, clip),
            # By name: the order of the variants would tell which is which.
            "films": sorted(names[clip, v] for v in variants),
        }
        for part, clip, variants in asked
    ]
    shown = {names[pair]: data_uri(film, "video/mp4") for pair, film in films.items()}
    shown |= {_name(seed, clip): data_uri(mp4(*told), "video/mp4") for clip, told in recordings.items()}
    number = hashlib.sha256(json.dumps([sets, sorted(shown)]).encode()).hexdigest()[:12]
    page = {"format": FORMAT, "study": number, "seed": seed, "groups": GROUPS, "sets": sets, "films": shown}
    key = {
        "format": KEY,
        "study": number,
        "films": {names[c, v]: {"clip": c, "variant": v} for c, v in films},
        "sets": {one["set"]: {"part": one["part"], "films": one["films"]} for one in sets},
    }
    return page, key


def _name(*told: Any) -> str:
    """One that tells nothing."""
    return hashlib.sha256("\n".join(map(str, told)).encode()).hexdigest()[:10]


def preferences(key: Mapping[str, Any], answers: Iterable[Mapping[str, Any]], draws: int = 2000) -> dict[str, Any]:
    """Share of choices [%] of each variant by part and group, with 90 % intervals over participants.

    A participant counts once in each part, with the share of the answered sets that went to a variant, so nobody counts
    more who answered more; intervals are percentiles of a bootstrap that draws participants again. `chance` is what
    guessing would give. Left out, and counted: answers to another study, those that leave more than half of a part
    open, a second sheet of the same participant, sheets with answers that no film of the set is.
    """
    kept: dict[str, Mapping[str, Any]] = {}
    left = {"of another study": 0, "a participant's second": 0, "not of these films": 0}
    for sheet in answers:
        if sheet.get("format") != FORMAT or sheet.get("study") != key["study"]:
            left["of another study"] += 1
        elif sheet["participant"] in kept:
            left["a participant's second"] += 1
        elif any(
            a["set"] not in key["sets"] or a["chosen"] not in key["sets"][a["set"]]["films"] for a in sheet["answers"]
        ):
            left["not of these films"] += 1
        else:
            kept[sheet["participant"]] = sheet
    found = {part: {g: _shares(key, part, kept.values(), g, draws) for g in (*GROUPS, "all")} for part in PARTS}
    return {"study": key["study"], "participants": len(kept), "left_out": left, "unit": "%", "parts": found}


def _shares(key, part: str, sheets: Iterable[Mapping[str, Any]], group: str, draws: int) -> dict[str, Any]:
    variants, sets = PARTS[part], [s for s, one in key["sets"].items() if one["part"] == part]
    rows = []
    for sheet in sheets:
        chosen = [key["films"][a["chosen"]]["variant"] for a in sheet["answers"] if a["set"] in sets]
        if group in ("all", sheet["group"]) and 2 * len(chosen) >= len(sets) > 0:
            rows.append([chosen.count(v) / len(chosen) for v in variants])
    if not rows:
        return {"participants": 0}
    table, rng = 100 * np.array(rows), np.random.default_rng(0)
    again = table[rng.integers(0, len(table), (draws, len(table)))].mean(1)
    low, high = np.percentile(again, [5, 95], axis=0) if len(table) > 1 else (None, None)
    return {
        "participants": len(table),
        "chance": round(100 / len(variants), 1),
        "shares": {
            v: {
                "mean": round(float(table[:, n].mean()), 1),
                "low": None if low is None else round(float(low[n]), 1),
                "high": None if high is None else round(float(high[n]), 1),
            }
            for n, v in enumerate(variants)
        },
    }


def told(texts: Sequence[tuple[str, str]]) -> list[dict[str, Any]]:
    """Sheets of answers, from (where, JSON). Raises Problem for what is none."""
    sheets = []
    for where, text in texts:
        try:
            sheet = json.loads(text)
        except json.JSONDecodeError as error:
            raise Problem(f"{where}: is not JSON ({error}). Pass the files that the page's last step saves.") from error
        wanted = {"format", "study", "participant", "group", "answers"}
        if not isinstance(sheet, dict) or not wanted <= set(sheet):
            raise Problem(f"{where}: is no sheet of answers. Pass the files that the page's last step saves.")
        sheets.append(sheet)
    return sheets
