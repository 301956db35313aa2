"""Pictures of runs that the README shows: `snakemake pictures` in the checkout."""


rule clip_pictures:
    input:
        frames="results/{clip}/main/ingest/frames.npz",
        camera="results/{clip}/main/ingest/camera.json",
        scene="results/{clip}/main/reconstruction/scene.ply",
        replay="results/{clip}/main/simulation/replay.npz",
    output:
        moving="docs/pictures/{clip}_replay.webp",
        still="docs/pictures/{clip}_scene.jpg",
    log:
        "logs/{clip}/main/clip_pictures.log",
    benchmark:
        "benchmarks/{clip}/main/clip_pictures.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        code=code("clip_pictures"),
    shell:
        'python "$SURGISIM/stages/clip_pictures.py" --frames {input.frames} --camera {input.camera}'
        " --scene {input.scene} --replay {input.replay} --moving {output.moving} --still {output.still}"
        " --code {params.code} > {log} 2>&1"


rule pictures:
    input:
        expand("docs/pictures/{clip}_replay.webp", clip=PLAN.clips),
