"""What the simulation of a clip lacks; asked for by name, `snakemake clip_diagnoses`.

A clip that went through the graph becomes a recording folder, and is diagnosed as any other recording.
"""


rule recorded:
    input:
        body=upstream("estimation", "body.npz"),
        material=upstream("estimation", "material.npz"),
        physics=upstream("estimation", "physics.json"),
        tracks=upstream("tracking", "tracks.npz"),
        motion=upstream("estimation", "motion.npz"),
        frames=upstream("ingest", "frames.npz"),
        camera=upstream("ingest", "camera.json"),
        doubts=upstream("estimation", "doubts.npz"),
        fit=upstream("estimation", "fit.json"),
    output:
        recording="results/{clip}/{variant}/diagnosis/recording/recording.json",
        rest="results/{clip}/{variant}/diagnosis/recording/rest.ply",
        fixed="results/{clip}/{variant}/diagnosis/recording/fixed.json",
        grip="results/{clip}/{variant}/diagnosis/recording/grip.npz",
        points="results/{clip}/{variant}/diagnosis/recording/tracks.npz",
        split="results/{clip}/{variant}/diagnosis/recording/split.json",
    log:
        "logs/{clip}/{variant}/recorded.log",
    benchmark:
        "benchmarks/{clip}/{variant}/recorded.tsv"
    conda:
        "../../envs/physics.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        settings=lambda w: json.dumps({"name": f"{w.clip}.{w.variant}"}),
        code=code("recorded"),
    shell:
        'python "$SURGISIM/stages/recorded.py"'
        " --body {input.body} --material {input.material} --physics {input.physics} --tracks {input.tracks}"
        " --motion {input.motion} --frames {input.frames} --camera {input.camera} --doubts {input.doubts}"
        " --fit {input.fit}"
        " --recording {output.recording} --rest {output.rest} --fixed {output.fixed} --grip {output.grip}"
        " --points {output.points} --split {output.split}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule clip_diagnosis:
    input:
        recording=expand(
            "results/{{clip}}/{{variant}}/diagnosis/recording/{name}", name=FILES
        ),
    output:
        diagnosis="results/{clip}/{variant}/diagnosis/diagnosis.json",
        physics="results/{clip}/{variant}/diagnosis/physics.json",
        mismatch="results/{clip}/{variant}/diagnosis/mismatch.npz",
        cloud="results/{clip}/{variant}/diagnosis/mismatch.ply",
    log:
        "logs/{clip}/{variant}/clip_diagnosis.log",
    benchmark:
        "benchmarks/{clip}/{variant}/clip_diagnosis.tsv"
    conda:
        "../../envs/physics.yaml"
    threads: 2
    resources:
        mem_mb=growing(4000),
        gpu=0,
    params:
        recording=folder,
        settings=settings("diagnosis", "clip_diagnosis"),
        work=work,
        code=code("diagnosis"),
    shell:
        'python "$SURGISIM/workflow/lease.py" {resources.gpu} python "$SURGISIM/stages/diagnosis.py"'
        " --recording {params.recording} --diagnosis {output.diagnosis} --physics {output.physics}"
        " --mismatch {output.mismatch} --cloud {output.cloud} --work {params.work}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"
        " && rm -rf {params.work}"


rule clip_diagnosis_report:
    input:
        recording=expand(
            "results/{{clip}}/{{variant}}/diagnosis/recording/{name}", name=FILES
        ),
        diagnosis="results/{clip}/{variant}/diagnosis/diagnosis.json",
        physics="results/{clip}/{variant}/diagnosis/physics.json",
        mismatch="results/{clip}/{variant}/diagnosis/mismatch.npz",
    output:
        page="results/{clip}/{variant}/diagnosis/diagnosis.html",
    log:
        "logs/{clip}/{variant}/clip_diagnosis_report.log",
    benchmark:
        "benchmarks/{clip}/{variant}/clip_diagnosis_report.tsv"
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


rule clip_diagnoses:
    input:
        expand(
            "results/{clip}/{variant}/diagnosis/diagnosis.html",
            clip=PLAN.clips,
            variant=PLAN.run,
        ),
