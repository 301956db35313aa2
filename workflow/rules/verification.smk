"""The engine compared with what is known; asked for by name, `snakemake verification`."""

from surgisim.verification.cases import absence, cases

# A case whose data are not here is left out, and the page says why.
CASES = [name for name, case in cases().items() if absence(case) is None]


rule verification_case:
    output:
        figures="docs/verification/{case}.json",
        picture="docs/verification/{case}.png",
    log:
        "logs/verification/{case}.log",
    benchmark:
        "benchmarks/verification/{case}.tsv"
    wildcard_constraints:
        case="|".join(cases()),
    conda:
        "../../envs/physics.yaml"
    threads: 2
    resources:
        mem_mb=growing(4000),
    params:
        code=lambda w: digest(ROOT / f"surgisim/verification/{w.case}.py", ROOT),
    shell:
        "python -m surgisim.verification {wildcards.case} --no-page --out docs/verification > {log} 2>&1"


rule verification:
    input:
        figures=expand("docs/verification/{case}.json", case=CASES),
        pictures=expand("docs/verification/{case}.png", case=CASES),
    output:
        page="docs/verification.md",
    log:
        "logs/verification.log",
    benchmark:
        "benchmarks/verification.tsv"
    conda:
        "../../envs/physics.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        code=lambda w: digest(ROOT / "surgisim/verification/page.py", ROOT),
    shell:
        "python -m surgisim.verification --only-page --out docs/verification --page {output.page} > {log} 2>&1"
