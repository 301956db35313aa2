"""Replays beside simpler bodies: `snakemake real_clips --config clips=mine.tsv run='[main,elastic_default,no_estimation]'`."""


rule real_clips:
    input:
        "results/clips.json",


rule clip_table:
    input:
        metrics=expand(
            "results/{clip}/{variant}/evaluation/metrics.json",
            clip=PLAN.clips,
            variant=PLAN.run,
        ),
    output:
        table="results/clips.json",
        picture="results/clips.png",
    log:
        "logs/clip_table.log",
    benchmark:
        "benchmarks/clip_table.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        code=lambda w: _code("clip_table"),
    shell:
        'python "$SURGISIM/stages/clip_table.py"'
        " --metrics {input.metrics}"
        " --table {output.table} --picture {output.picture} --code {params.code} 2> {log}"
