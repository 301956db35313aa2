"""What the run achieved, in numbers and on one page."""


rule evaluation:
    input:
        frames=upstream("ingest", "frames.npz"),
        camera=upstream("ingest", "camera.json"),
        given=upstream("ingest", "given.npz"),
        masks=upstream("masking", "masks.npz"),
        inpainted=upstream("inpainting", "inpainted.npz"),
        depth=upstream("depth", "depth.npz"),
        tracks=upstream("tracking", "tracks.npz"),
        motion=upstream("estimation", "motion.npz"),
        scene=upstream("reconstruction", "scene.ply"),
        deformation=upstream("reconstruction", "deformation.npz"),
        rendered=upstream("reconstruction", "rendered.npz"),
        body=upstream("estimation", "body.npz"),
        physics=upstream("estimation", "physics.json"),
        fit=upstream("estimation", "fit.json"),
        replay=upstream("simulation", "replay.npz"),
        truth=truth,
        found=upstream("tracking", "motion.npz"),
    output:
        metrics=report(
            "results/{clip}/{variant}/evaluation/metrics.json",
            caption="../report/metrics.rst",
            category="{clip}",
            labels={"variant": "{variant}", "what": "numbers"},
        ),
    log:
        "logs/{clip}/{variant}/evaluation.log",
    benchmark:
        "benchmarks/{clip}/{variant}/evaluation.tsv"
    conda:
        "../../envs/report.yaml"
    threads: 4
    resources:
        mem_mb=growing(3000),
    params:
        truth=lambda w, input: f"--truth {input.truth}" if input.truth else "",
        benchmarks=benchmarks,
        settings=settings("evaluation"),
        code=code("evaluation"),
    shell:
        'python "$SURGISIM/stages/evaluation.py"'
        " --frames {input.frames} --camera {input.camera} --given {input.given} --masks {input.masks}"
        " --inpainted {input.inpainted} --depth {input.depth} --tracks {input.tracks}"
        " --motion {input.motion} --scene {input.scene} --deformation {input.deformation}"
        " --rendered {input.rendered}"
        " --body {input.body} --physics {input.physics} --fit {input.fit} --replay {input.replay}"
        " {params.truth} --found {input.found} --benchmarks {params.benchmarks}"
        " --metrics {output.metrics}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule report:
    input:
        frames=upstream("ingest", "frames.npz"),
        camera=upstream("ingest", "camera.json"),
        given=upstream("ingest", "given.npz"),
        masks=upstream("masking", "masks.npz"),
        inpainted=upstream("inpainting", "inpainted.npz"),
        depth=upstream("depth", "depth.npz"),
        tracks=upstream("tracking", "tracks.npz"),
        motion=upstream("estimation", "motion.npz"),
        scene=upstream("reconstruction", "scene.ply"),
        deformation=upstream("reconstruction", "deformation.npz"),
        rendered=upstream("reconstruction", "rendered.npz"),
        body=upstream("estimation", "body.npz"),
        material=upstream("estimation", "material.npz"),
        physics=upstream("estimation", "physics.json"),
        fit=upstream("estimation", "fit.json"),
        replay=upstream("simulation", "replay.npz"),
        metrics=upstream("evaluation", "metrics.json"),
        truth=truth,
    output:
        report=report(
            "results/{clip}/{variant}/report/report.html",
            caption="../report/page.rst",
            category="{clip}",
            labels={"variant": "{variant}", "what": "everything"},
        ),
        yt=report(
            "results/{clip}/{variant}/report/yt.png",
            caption="../report/yt.rst",
            category="{clip}",
            labels={"variant": "{variant}", "what": "Y-T slices"},
        ),
        thumbnail="results/{clip}/{variant}/report/thumbnail.jpg",
    log:
        "logs/{clip}/{variant}/report.log",
    benchmark:
        "benchmarks/{clip}/{variant}/report.tsv"
    conda:
        "../../envs/report.yaml"
    threads: 4
    resources:
        mem_mb=growing(3000),
    params:
        truth=lambda w, input: f"--truth {input.truth}" if input.truth else "",
        settings=drawn,
        code=code("report"),
    shell:
        'python "$SURGISIM/stages/report.py"'
        " --frames {input.frames} --camera {input.camera} --given {input.given} --masks {input.masks}"
        " --inpainted {input.inpainted} --depth {input.depth} --tracks {input.tracks}"
        " --motion {input.motion} --scene {input.scene} --deformation {input.deformation}"
        " --rendered {input.rendered} --body {input.body} --material {input.material}"
        " --physics {input.physics} --fit {input.fit} --replay {input.replay}"
        " --metrics {input.metrics} {params.truth} --report {output.report}"
        " --yt {output.yt} --thumbnail {output.thumbnail}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule summary:
    input:
        metrics=expand(
            "results/{clip}/{variant}/evaluation/metrics.json",
            clip=PLAN.clips,
            variant=PLAN.run,
        ),
        # The reports too: the page links to them.
        thumbnails=expand(
            "results/{clip}/{variant}/report/thumbnail.jpg",
            clip=PLAN.clips,
            variant=PLAN.run,
        ),
        reports=expand(
            "results/{clip}/{variant}/report/report.html",
            clip=PLAN.clips,
            variant=PLAN.run,
        ),
    output:
        table="results/summary.json",
        page="results/summary.html",
    log:
        "logs/summary.log",
    benchmark:
        "benchmarks/summary.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        settings=lambda w: json.dumps({"runs": chosen_runs()}, sort_keys=True),
        code=lambda w: _code("summary"),
    shell:
        'python "$SURGISIM/stages/summary.py"'
        " --metrics {input.metrics} --thumbnails {input.thumbnails}"
        " --table {output.table} --page {output.page}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"
