"""Whether the evidence of nothing but noise and nuisances is what a diagnosis states.

`snakemake self_consistency --config drawn_from=FOLDER draws=100`: recordings drawn from the model that a diagnosis has
of the recording in FOLDER, each diagnosed again.
"""


wildcard_constraints:
    number=r"\d+",


rule draws:
    input:
        recording=drawn_from,
    output:
        draws="self_consistency/draws.npz",
    log:
        "logs/self_consistency/draws.log",
    benchmark:
        "benchmarks/self_consistency/draws.tsv"
    conda:
        "../../envs/physics.yaml"
    threads: 2
    resources:
        mem_mb=growing(4000),
    params:
        recording=folder,
        settings=json.dumps(
            {
                "count": DRAWS,
                "seed": SEED,
                "diagnosis": json.loads(with_changes(OF_NULLS)),
            }
        ),
        code=code("draws"),
    shell:
        'python "$SURGISIM/stages/draws.py" --recording {params.recording:q} --draws {output.draws}'
        " --work self_consistency/work --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule draw:
    input:
        recording=drawn_from,
        draws="self_consistency/draws.npz",
    output:
        recording="self_consistency/{number}/recording/recording.json",
        rest="self_consistency/{number}/recording/rest.ply",
        fixed="self_consistency/{number}/recording/fixed.json",
        grip="self_consistency/{number}/recording/grip.npz",
        tracks="self_consistency/{number}/recording/tracks.npz",
        split="self_consistency/{number}/recording/split.json",
    log:
        "logs/self_consistency/{number}/draw.log",
    benchmark:
        "benchmarks/self_consistency/{number}/draw.tsv"
    conda:
        "../../envs/physics.yaml"
    resources:
        mem_mb=growing(1000),
    params:
        recording=folder,
        settings=lambda w: json.dumps({"number": int(w.number)}),
        code=code("draw"),
    shell:
        'python "$SURGISIM/stages/draw.py" --recording {params.recording:q} --draws {input.draws}'
        " --drawn {output.recording} --rest {output.rest} --fixed {output.fixed} --grip {output.grip}"
        " --tracks {output.tracks} --split {output.split}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule drawn_diagnosis:
    input:
        recording=expand("self_consistency/{{number}}/recording/{name}", name=FILES),
    output:
        diagnosis="self_consistency/{number}/diagnosis.json",
        physics="self_consistency/{number}/physics.json",
        mismatch="self_consistency/{number}/mismatch.npz",
        cloud="self_consistency/{number}/mismatch.ply",
    log:
        "logs/self_consistency/{number}/diagnosis.log",
    benchmark:
        "benchmarks/self_consistency/{number}/diagnosis.tsv"
    conda:
        "../../envs/physics.yaml"
    threads: 2
    resources:
        mem_mb=growing(4000),
        gpu=0,
    params:
        recording=folder,
        settings=placed(lambda w: with_changes(OF_NULLS), "drawn_diagnosis"),
        code=code("diagnosis"),
    shell:
        'python "$SURGISIM/workflow/lease.py" {resources.gpu} python "$SURGISIM/stages/diagnosis.py"'
        " --recording {params.recording} --diagnosis {output.diagnosis} --physics {output.physics}"
        " --mismatch {output.mismatch} --cloud {output.cloud} --work self_consistency/{wildcards.number}/work"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule self_consistency:
    input:
        diagnoses=expand(
            "self_consistency/{number}/diagnosis.json", number=range(DRAWS)
        ),
    output:
        table="self_consistency/self_consistency.json",
        picture="self_consistency/self_consistency.png",
    log:
        "logs/self_consistency/self_consistency.log",
    benchmark:
        "benchmarks/self_consistency/self_consistency.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(1000),
    params:
        code=code("self_consistency"),
    shell:
        'python "$SURGISIM/stages/self_consistency.py" --diagnoses {input.diagnoses}'
        " --table {output.table} --picture {output.picture} --code {params.code} > {log} 2>&1"
