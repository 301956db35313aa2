"""The clip that the project invents, and what is true of it. The truth goes to the evaluation and nowhere else."""


rule phantom:
    output:
        clip="results/{clip}/{variant}/phantom/clip.mp4",
        truth="results/{clip}/{variant}/phantom/truth.npz",
    log:
        "logs/{clip}/{variant}/phantom.log",
    benchmark:
        "benchmarks/{clip}/{variant}/phantom.tsv"
    conda:
        "../../envs/physics.yaml"
    threads: 2
    resources:
        mem_mb=growing(2000),
    params:
        settings=settings("phantom"),
        code=code("phantom"),
    shell:
        'python "$SURGISIM/stages/phantom.py"'
        " --clip {output.clip} --truth {output.truth}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"
