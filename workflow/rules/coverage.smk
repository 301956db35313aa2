"""Whether intervals hold the truth: `snakemake coverage --config clips=40 seed=7`, on clips that the phantom invents."""


rule coverage:
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
        "logs/coverage.log",
    benchmark:
        "benchmarks/coverage.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=2000,
    params:
        code=lambda w: _code("interval_coverage"),
    shell:
        'python "$SURGISIM/stages/interval_coverage.py"'
        " --metrics {input.metrics}"
        " --table {output.table} --picture {output.picture} --code {params.code} 2> {log}"
