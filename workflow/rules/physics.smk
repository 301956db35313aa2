"""What the tissue is made of, found by simulation, and what it does next."""


rule estimation:
    input:
        body=upstream("thickening", "body.npz"),
        scene=upstream("reconstruction", "scene.ply"),
        tracks=upstream("tracking", "tracks.npz"),
        motion=upstream("tracking", "motion.npz"),
        frames=upstream("ingest", "frames.npz"),
        masks=upstream("masking", "masks.npz"),
        camera=upstream("ingest", "camera.json"),
    output:
        material="results/{clip}/{variant}/estimation/material.npz",
        physics="results/{clip}/{variant}/estimation/physics.json",
        fit="results/{clip}/{variant}/estimation/fit.json",
        carried="results/{clip}/{variant}/estimation/motion.npz",
        laid="results/{clip}/{variant}/estimation/body.npz",
        doubts="results/{clip}/{variant}/estimation/doubts.npz",
    log:
        "logs/{clip}/{variant}/estimation.log",
    benchmark:
        "benchmarks/{clip}/{variant}/estimation.tsv"
    conda:
        "../../envs/physics.yaml"
    threads: 2
    resources:
        mem_mb=growing(4000),
        gpu=0,
    params:
        settings=settings("estimation"),
        code=code("estimation"),
    shell:
        'python "$SURGISIM/workflow/lease.py" {resources.gpu} python "$SURGISIM/stages/estimation.py"'
        " --body {input.body} --scene {input.scene} --tracks {input.tracks} --motion {input.motion}"
        " --frames {input.frames} --masks {input.masks} --camera {input.camera}"
        " --material {output.material} --physics {output.physics} --fit {output.fit}"
        " --carried {output.carried} --laid {output.laid} --doubts {output.doubts}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule simulation:
    input:
        body=upstream("estimation", "body.npz"),
        scene=upstream("reconstruction", "scene.ply"),
        material=upstream("estimation", "material.npz"),
        physics=upstream("estimation", "physics.json"),
        motion=upstream("estimation", "motion.npz"),
        camera=upstream("ingest", "camera.json"),
        frames=upstream("ingest", "frames.npz"),
        masks=upstream("masking", "masks.npz"),
    output:
        replay="results/{clip}/{variant}/simulation/replay.npz",
        video=report(
            "results/{clip}/{variant}/simulation/video.mp4",
            caption="../report/video.rst",
            category="{clip}",
            labels={"variant": "{variant}", "what": "replay"},
        ),
        final="results/{clip}/{variant}/simulation/final.ply",
        yt="results/{clip}/{variant}/simulation/yt.png",
    log:
        "logs/{clip}/{variant}/simulation.log",
    benchmark:
        "benchmarks/{clip}/{variant}/simulation.tsv"
    conda:
        "../../envs/physics.yaml"
    threads: 2
    resources:
        mem_mb=growing(4000),
        gpu=0,
    params:
        settings=settings("simulation"),
        code=code("simulation"),
    shell:
        'python "$SURGISIM/workflow/lease.py" {resources.gpu} python "$SURGISIM/stages/simulation.py"'
        " --body {input.body} --scene {input.scene} --material {input.material}"
        " --physics {input.physics} --motion {input.motion} --camera {input.camera}"
        " --frames {input.frames} --masks {input.masks} --replay {output.replay} --video {output.video}"
        " --final {output.final} --yt {output.yt}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"
