"""The paper's tables, ours beside what it prints: `snakemake tables --config clips=mine.tsv`."""


wildcard_constraints:
    again=r"\d+",


rule scene_again:
    input:
        frames=upstream("ingest", "frames.npz"),
        inpainted=upstream("inpainting", "inpainted.npz"),
        masks=upstream("masking", "masks.npz"),
        correspondence=upstream("correspondence", "correspondence.npz"),
        depth=upstream("depth", "depth.npz"),
        camera=upstream("ingest", "camera.json"),
    output:
        scene="results/{clip}/{variant}/scenes/{again}/scene.ply",
        deformation="results/{clip}/{variant}/scenes/{again}/deformation.npz",
        rendered="results/{clip}/{variant}/scenes/{again}/rendered.npz",
    log:
        "logs/{clip}/{variant}/scenes/{again}.log",
    benchmark:
        "benchmarks/{clip}/{variant}/scenes/{again}/reconstruction.tsv"
    conda:
        "../../envs/scene.yaml"
    threads: 2
    resources:
        mem_mb=growing(4000),
        gpu=0,
    params:
        settings=placed(
            lambda w: json.dumps(
                json.loads(PLAN.slices["reconstruction", w.clip, w.variant])
                | {"seed": int(w.again)},
                sort_keys=True,
            ),
            "scene_again",
        ),
        code=code("reconstruction"),
    shell:
        'python "$SURGISIM/workflow/lease.py" {resources.gpu} python "$SURGISIM/stages/reconstruction.py"'
        " --frames {input.frames} --inpainted {input.inpainted} --masks {input.masks}"
        " --correspondence {input.correspondence} --depth {input.depth} --camera {input.camera}"
        " --scene {output.scene} --deformation {output.deformation} --rendered {output.rendered}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule scene_score:
    input:
        frames=upstream("ingest", "frames.npz"),
        camera=upstream("ingest", "camera.json"),
        given=upstream("ingest", "given.npz"),
        masks=upstream("masking", "masks.npz"),
        inpainted=upstream("inpainting", "inpainted.npz"),
        depth=upstream("depth", "depth.npz"),
        tracks=upstream("tracking", "tracks.npz"),
        scene="results/{clip}/{variant}/scenes/{again}/scene.ply",
        deformation="results/{clip}/{variant}/scenes/{again}/deformation.npz",
        rendered="results/{clip}/{variant}/scenes/{again}/rendered.npz",
        truth=truth,
    output:
        metrics="results/{clip}/{variant}/scenes/{again}/metrics.json",
        picture="results/{clip}/{variant}/scenes/{again}/surface.png",
    log:
        "logs/{clip}/{variant}/scenes/{again}_score.log",
    benchmark:
        "benchmarks/{clip}/{variant}/scenes/{again}/scene_score.tsv"
    conda:
        "../../envs/report.yaml"
    threads: 2
    resources:
        mem_mb=growing(3000),
    params:
        truth=lambda w, input: f"--truth {input.truth}" if input.truth else "",
        benchmarks="benchmarks/{clip}/{variant}/scenes/{again}/reconstruction.tsv",
        settings=lambda w: json.dumps(
            json.loads(PLAN.slices["evaluation", w.clip, w.variant])
            | {"seed": int(w.again)},
            sort_keys=True,
        ),
        code=code("scene_score"),
    shell:
        'python "$SURGISIM/stages/scene_score.py"'
        " --frames {input.frames} --camera {input.camera} --given {input.given} --masks {input.masks}"
        " --inpainted {input.inpainted} --depth {input.depth} --tracks {input.tracks}"
        " --scene {input.scene} --deformation {input.deformation} --rendered {input.rendered}"
        " {params.truth} --benchmarks {params.benchmarks} --metrics {output.metrics} --picture {output.picture}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule tables:
    input:
        metrics=expand(
            "results/{clip}/{variant}/evaluation/metrics.json",
            clip=PLAN.clips,
            variant=TABLED,
        ),
        scenes=[
            *expand(
                "results/{clip}/{variant}/scenes/{again}/metrics.json",
                clip=PLAN.clips,
                variant=TERMS,
                again=AGAIN,
            ),
            *expand(
                "results/{clip}/near_light/scenes/{again}/metrics.json",
                clip=[c for c in PLAN.clips if with_depth(c)],
                again=AGAIN[:1],
            ),
        ],
        recordings=[
            str(clip.path or f"results/{name}/main/phantom/clip.mp4")
            for name, clip in PLAN.clips.items()
        ],
        pictures=expand(
            "results/{clip}/{variant}/scenes/{again}/surface.png",
            clip=PLAN.clips,
            variant=TERMS,
            again=AGAIN[:1],
        ),
    output:
        table="results/tables/tables.json",
        page="results/tables/tables.html",
        sheet="results/tables/tables.csv",
        text="results/tables/tables.md",
    log:
        "logs/tables.log",
    benchmark:
        "benchmarks/tables.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        settings=lambda w: json.dumps(
            {"receipt": receipt(), "clips": list(PLAN.clips)}, sort_keys=True
        ),
        code=code("tables"),
    shell:
        'python "$SURGISIM/stages/tables.py"'
        " --metrics {input.metrics} --scenes {input.scenes} --recordings {input.recordings}"
        " --pictures {input.pictures}"
        " --table {output.table} --page {output.page} --sheet {output.sheet} --text {output.text}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"
