"""The paper's preference study as a page: `snakemake study --config clips=mine.tsv`."""

# Variants that are shown, in the order of surgisim/proof/study.py.
SHOWN = list(dict.fromkeys(variant for part in STUDIED.values() for variant in part))


rule study:
    input:
        films=[
            f"results/{clip}/{PLAN.homes['simulation', clip, variant]}/simulation/video.mp4"
            for clip in PLAN.clips
            for variant in SHOWN
            if variant in PLAN.variants
        ],
        frames=[
            f"results/{clip}/{PLAN.homes['ingest', clip, 'main']}/ingest/frames.npz"
            for clip in PLAN.clips
        ],
        cameras=[
            f"results/{clip}/{PLAN.homes['ingest', clip, 'main']}/ingest/camera.json"
            for clip in PLAN.clips
        ],
    output:
        page="results/study/study.html",
        key="results/study/study_key.json",
    log:
        "logs/study.log",
    benchmark:
        "benchmarks/study.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        settings=lambda w: json.dumps(
            {
                "clips": list(PLAN.clips),
                "films": [
                    [clip, variant]
                    for clip in PLAN.clips
                    for variant in SHOWN
                    if variant in PLAN.variants
                ],
                "seed": SEED,
            },
            sort_keys=True,
        ),
        code=code("study"),
    shell:
        'python "$SURGISIM/stages/study.py"'
        " --films {input.films} --frames {input.frames} --cameras {input.cameras}"
        " --page {output.page} --key {output.key}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"
