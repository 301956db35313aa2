"""Whether intervals hold the truth: `snakemake coverage --config clips=40 seed=7`, on clips that the phantom invents."""


rule coverage:
    input:
        "results/coverage.json",


rule interval_coverage:
    input:
        metrics=expand(
            "results/{clip}/{variant}/evaluation/metrics.json",
            clip=PLAN.clips,
            variant=PLAN.run,
        ),
    output:
        table="results/coverage.json",
        picture="results/coverage.png",
    log:
        "logs/interval_coverage.log",
    benchmark:
        "benchmarks/interval_coverage.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        code=lambda w: _code("interval_coverage"),
    shell:
        'python "$SURGISIM/stages/interval_coverage.py"'
        " --metrics {input.metrics}"
        " --table {output.table} --picture {output.picture} --code {params.code} 2> {log}"
