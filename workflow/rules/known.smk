"""Real recordings with a cause that their makers know; asked for by name, `snakemake blind_real`."""


wildcard_constraints:
    known="|".join(KNOWN),
    part="|".join(PARTS),


rule known:
    output:
        recording="known/{known}/{part}/recording.json",
        rest="known/{known}/{part}/rest.ply",
        fixed="known/{known}/{part}/fixed.json",
        grip="known/{known}/{part}/grip.npz",
        tracks="known/{known}/{part}/tracks.npz",
        split="known/{known}/{part}/split.json",
    log:
        "logs/known/{known}/{part}.log",
    benchmark:
        "benchmarks/known/{known}/{part}.tsv"
    conda:
        "../../envs/physics.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        settings=lambda w: json.dumps({"case": w.known, "part": w.part}),
        code=code("known"),
    shell:
        'python "$SURGISIM/stages/known.py"'
        " --recording {output.recording} --rest {output.rest} --fixed {output.fixed} --grip {output.grip}"
        " --tracks {output.tracks} --split {output.split}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule known_base:
    input:
        recording=expand("known/{{known}}/bare/{name}", name=FILES),
    output:
        diagnosis="known/{known}/base/diagnosis.json",
        physics="known/{known}/base/physics.json",
        mismatch="known/{known}/base/mismatch.npz",
        cloud="known/{known}/base/mismatch.ply",
    log:
        "logs/known/{known}/base.log",
    benchmark:
        "benchmarks/known/{known}/base.tsv"
    conda:
        "../../envs/physics.yaml"
    threads: 2
    resources:
        mem_mb=growing(4000),
        gpu=0,
    params:
        recording=folder,
        settings=placed(diagnosing, "known_diagnosis"),
        work=work,
        code=code("diagnosis"),
    shell:
        'python "$SURGISIM/workflow/lease.py" {resources.gpu} python "$SURGISIM/stages/diagnosis.py"'
        " --recording {params.recording} --diagnosis {output.diagnosis} --physics {output.physics}"
        " --mismatch {output.mismatch} --cloud {output.cloud} --work {params.work}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"
        " && rm -rf {params.work}"


rule known_diagnosis:
    input:
        recording=expand("known/{{known}}/recording/{name}", name=FILES),
        hold_out=known_hold_out,
        base=known_base,
    output:
        diagnosis="known/{known}/diagnosis.json",
        physics="known/{known}/physics.json",
        mismatch="known/{known}/mismatch.npz",
        cloud="known/{known}/mismatch.ply",
    log:
        "logs/known/{known}/diagnosis.log",
    benchmark:
        "benchmarks/known/{known}/diagnosis.tsv"
    conda:
        "../../envs/physics.yaml"
    threads: 2
    resources:
        mem_mb=growing(4000),
        gpu=0,
    params:
        recording=folder,
        beside=known_beside,
        settings=placed(diagnosing, "known_diagnosis"),
        work=work,
        code=code("diagnosis"),
    shell:
        'python "$SURGISIM/workflow/lease.py" {resources.gpu} python "$SURGISIM/stages/diagnosis.py"'
        " --recording {params.recording} {params.beside}"
        " --diagnosis {output.diagnosis} --physics {output.physics}"
        " --mismatch {output.mismatch} --cloud {output.cloud} --work {params.work}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"
        " && rm -rf {params.work}"


rule known_report:
    input:
        recording=expand("known/{{known}}/recording/{name}", name=FILES),
        diagnosis="known/{known}/diagnosis.json",
        physics="known/{known}/physics.json",
        mismatch="known/{known}/mismatch.npz",
    output:
        page="known/{known}/diagnosis.html",
    log:
        "logs/known/{known}/diagnosis_report.log",
    benchmark:
        "benchmarks/known/{known}/diagnosis_report.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        recording=folder,
        code=code("diagnosis_report"),
    shell:
        'python "$SURGISIM/stages/diagnosis_report.py" --recording {params.recording}'
        " --diagnosis {input.diagnosis} --physics {input.physics} --mismatch {input.mismatch}"
        " --page {output.page} --code {params.code} > {log} 2>&1"


rule known_score:
    input:
        diagnosis="known/{known}/diagnosis.json",
        physics="known/{known}/physics.json",
        page="known/{known}/diagnosis.html",
    output:
        score="known/{known}/score.json",
    log:
        "logs/known/{known}/known_score.log",
    benchmark:
        "benchmarks/known/{known}/known_score.tsv"
    conda:
        "../../envs/physics.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        settings=lambda w: json.dumps({"case": w.known}),
        code=code("known_score"),
    shell:
        'python "$SURGISIM/stages/known_score.py" --diagnosis {input.diagnosis} --physics {input.physics}'
        " --score {output.score} --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule known_direct:
    output:
        score="known/direct/{known}/score.json",
        physics="known/direct/{known}/physics.json",
    log:
        "logs/known/{known}/known_direct.log",
    benchmark:
        "benchmarks/known/{known}/known_direct.tsv"
    conda:
        "../../envs/physics.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        settings=lambda w: json.dumps({"case": w.known}),
        code=code("known_direct"),
    shell:
        'python "$SURGISIM/stages/known_direct.py" --score {output.score} --physics {output.physics}'
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule known_board:
    input:
        score=[
            f"known/{'direct/' if known.direct else ''}{name}/score.json"
            for name, known in KNOWN.items()
        ],
        # The board links to them.
        pages=[
            f"known/{name}/diagnosis.html"
            for name, known in KNOWN.items()
            if not known.direct
        ],
    output:
        table="known/known.json",
        page=report(
            "known/known.html",
            caption="../report/known.rst",
            category="real recordings with a known cause",
        ),
    log:
        "logs/known/known_board.log",
    benchmark:
        "benchmarks/known/known_board.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(1000),
    params:
        code=code("known_board"),
    shell:
        'python "$SURGISIM/stages/known_board.py" --score {input.score}'
        " --table {output.table} --page {output.page} --code {params.code} > {log} 2>&1"


rule blind_real:
    input:
        "known/known.html",
