"""Pictures of finished work: `snakemake gallery`, a page to publish; `snakemake pictures`, in the checkout, the README's."""

# Pictures of all runs together take two thirds of the gallery's page; written as text, a byte takes four thirds.
MOST_BYTES = 8_000_000
SHARE = MOST_BYTES // (2 * len(PLAN.clips))


rule clip_pictures:
    input:
        frames=upstream("ingest", "frames.npz"),
        camera=upstream("ingest", "camera.json"),
        scene=upstream("reconstruction", "scene.ply"),
        body=upstream("estimation", "body.npz"),
        material=upstream("estimation", "material.npz"),
        motion=upstream("estimation", "motion.npz"),
        replay=upstream("simulation", "replay.npz"),
    output:
        moving="results/{clip}/{variant}/pictures/moving.webp",
        still="results/{clip}/{variant}/pictures/scene.jpg",
        fitted="results/{clip}/{variant}/pictures/body.jpg",
    log:
        "logs/{clip}/{variant}/clip_pictures.log",
    benchmark:
        "benchmarks/{clip}/{variant}/clip_pictures.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        settings=lambda w: json.dumps(
            {
                "moving_bytes": min(SHARE * 3 // 4, 1_000_000),
                "still_bytes": min(SHARE // 8, 200_000),
            }
        ),
        code=code("clip_pictures"),
    shell:
        'python "$SURGISIM/stages/clip_pictures.py" --frames {input.frames} --camera {input.camera}'
        " --scene {input.scene} --body {input.body} --material {input.material} --motion {input.motion}"
        " --replay {input.replay} --moving {output.moving} --still {output.still} --fitted {output.fitted}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule gallery:
    input:
        moving=expand("results/{clip}/main/pictures/moving.webp", clip=PLAN.clips),
        still=expand("results/{clip}/main/pictures/scene.jpg", clip=PLAN.clips),
        fitted=expand("results/{clip}/main/pictures/body.jpg", clip=PLAN.clips),
        physics=shown_clips("estimation", "physics.json"),
        fit=shown_clips("estimation", "fit.json"),
        metrics=shown_clips("evaluation", "metrics.json"),
        recording=shown_cases("blind/{seed}/{case}/recording/recording.json"),
        diagnosis=shown_cases("blind/{seed}/{case}/main/diagnosis.json"),
        mismatch=shown_cases("blind/{seed}/{case}/main/mismatch.npz"),
        named=shown_cases("blind/{seed}/{case}/main/physics.json"),
        score=shown_cases("blind/{seed}/{case}/main/score.json"),
    output:
        page=report(
            "results/gallery.html",
            caption="../report/gallery.rst",
            category="all clips",
            labels={"what": "gallery"},
        ),
    log:
        "logs/gallery.log",
    benchmark:
        "benchmarks/gallery.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(3000),
    params:
        recording=lambda w, input: [Path(path).parent for path in input.recording],
        settings=lambda w: json.dumps(
            {"clips": list(PLAN.clips), "most_bytes": MOST_BYTES}, sort_keys=True
        ),
        code=code("gallery"),
    shell:
        'python "$SURGISIM/stages/gallery.py"'
        " --moving {input.moving} --still {input.still} --fitted {input.fitted}"
        " --physics {input.physics} --fit {input.fit} --metrics {input.metrics}"
        " --recording {params.recording} --diagnosis {input.diagnosis} --mismatch {input.mismatch}"
        " --named {input.named} --score {input.score} --page {output.page}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule diagnosis_picture:
    input:
        recording=shown,
        diagnosis="blind/{seed}/{case}/{way}/diagnosis.json",
        physics="blind/{seed}/{case}/{way}/physics.json",
        mismatch="blind/{seed}/{case}/{way}/mismatch.npz",
    output:
        picture="blind/{seed}/{case}/{way}/mismatch.jpg",
    log:
        "logs/blind/{seed}/{case}/{way}/diagnosis_picture.log",
    benchmark:
        "benchmarks/blind/{seed}/{case}/{way}/diagnosis_picture.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        recording=folder,
        code=code("diagnosis_picture"),
    shell:
        'python "$SURGISIM/stages/diagnosis_picture.py" --recording {params.recording}'
        " --diagnosis {input.diagnosis} --physics {input.physics} --mismatch {input.mismatch}"
        " --picture {output.picture} --code {params.code} > {log} 2>&1"


rule kept_pictures:
    input:
        moving="results/{clip}/main/pictures/moving.webp",
        still="results/{clip}/main/pictures/scene.jpg",
        fitted="results/{clip}/main/pictures/body.jpg",
        mismatch=f"blind/{room(SEED)}/0/main/mismatch.jpg",
    output:
        moving="docs/pictures/{clip}_replay.webp",
        still="docs/pictures/{clip}_scene.jpg",
        fitted="docs/pictures/{clip}_body.jpg",
        mismatch="docs/pictures/{clip}_mismatch.jpg",
    log:
        "logs/{clip}/main/kept_pictures.log",
    benchmark:
        "benchmarks/{clip}/main/kept_pictures.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(500),
    shell:
        "(cp {input.moving} {output.moving} && cp {input.still} {output.still}"
        " && cp {input.fitted} {output.fitted} && cp {input.mismatch} {output.mismatch}) > {log} 2>&1"


rule pictures:
    input:
        expand("docs/pictures/{clip}_mismatch.jpg", clip=PLAN.clips),
