"""Score how verdicts hold when recordings are perturbed; a second set of diagnoses is shown beside the first.

reads   a folder of BODY/sealed/truth.json and BODY/PERTURBATION/diagnosis.json, and another one made before
writes  robustness.json, robustness.html, robustness.png
"""

from surgisim.config.robustness import Robustness
from surgisim.stage import Bytes, Source, stage


@stage(
    reads={
        "folder": Source("a folder of bodies"),
        "before": Source("the same of an earlier version; truths are read from the first", required=False),
    },
    writes={"table": Bytes(".json"), "page": Bytes(".html"), "picture": Bytes(".png")},
    settings=Robustness,
)
def main(folder, before, *, settings, progress):
    import json

    from surgisim.proof.robustness import robustness
    from surgisim.report.board.robustness import page, picture, words
    from surgisim.report.made import made

    found = robustness(folder, settings.bodies, settings.perturbations)
    earlier = robustness(folder, settings.bodies, settings.perturbations, before) if before else None
    print(words(found, earlier))
    told = found | {"before": earlier}
    return (
        (json.dumps(told, indent=1, allow_nan=False) + "\n").encode(),
        page(found, earlier, made({"robustness": settings.model_dump(mode="json")})),
        picture(found, earlier),
    )


if __name__ == "__main__":
    main()
