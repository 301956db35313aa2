"""Tally a preference study, as JSON: python -m surgisim.proof.preferences study_key.json ANSWERS.json ..."""

import argparse
import json
from pathlib import Path

from surgisim.problem import Problem
from surgisim.proof.study import KEY, preferences, told
from surgisim.stage import plain_errors


def main() -> None:
    cli = argparse.ArgumentParser(description=__doc__)
    cli.add_argument("key", type=Path, help="study_key.json, written beside the page")
    cli.add_argument("answers", type=Path, nargs="+", help="what participants' pages saved")
    asked = cli.parse_args()
    with plain_errors(False):
        key = json.loads(_text(asked.key))
        if not isinstance(key, dict) or key.get("format") != KEY:
            raise Problem(
                f"{asked.key}: is no key to a study. Pass the study_key.json that was written beside the page."
            )
        print(json.dumps(preferences(key, told([(str(path), _text(path)) for path in asked.answers])), indent=1))


def _text(path: Path) -> str:
    if not path.is_file():
        raise Problem(f"{path}: no such file.")
    return path.read_text("utf-8")


if __name__ == "__main__":
    main()
