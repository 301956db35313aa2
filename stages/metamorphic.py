"""Score how verdicts hold when recordings of which nobody knows the cause are perturbed.

reads   a folder of NAME/PERTURBATION/diagnosis.json, and another one made before
writes  metamorphic.json, metamorphic.html
"""

from surgisim.config.metamorphic import Metamorphic
from surgisim.stage import Bytes, Source, stage


@stage(
    reads={
        "folder": Source("a folder of recordings"),
        "before": Source("the same of an earlier version", required=False),
    },
    writes={"table": Bytes(".json"), "page": Bytes(".html")},
    settings=Metamorphic,
)
def main(folder, before, *, settings, progress):
    import json

    from surgisim.proof.metamorphic import metamorphic
    from surgisim.report.board.metamorphic import page
    from surgisim.report.made import made

    found = metamorphic(folder, settings.names, settings.perturbations)
    earlier = metamorphic(before, settings.names, settings.perturbations) if before else None
    told = made({"metamorphic": settings.model_dump(mode="json")})
    both = found | {"before": earlier}
    return (json.dumps(both, indent=1, allow_nan=False) + "\n").encode(), page(found, earlier, told)


if __name__ == "__main__":
    main()
