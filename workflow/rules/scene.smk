"""The tissue as a moving scene of Gaussians, and as a body with depth behind its surface."""


rule reconstruction:
    input:
        frames=upstream("ingest", "frames.npz"),
        inpainted=upstream("inpainting", "inpainted.npz"),
        masks=upstream("masking", "masks.npz"),
        correspondence=upstream("correspondence", "correspondence.npz"),
        depth=upstream("depth", "depth.npz"),
        camera=upstream("ingest", "camera.json"),
    output:
        scene="results/{clip}/{variant}/reconstruction/scene.ply",
        deformation="results/{clip}/{variant}/reconstruction/deformation.npz",
        rendered="results/{clip}/{variant}/reconstruction/rendered.npz",
    log:
        "logs/{clip}/{variant}/reconstruction.log",
    benchmark:
        "benchmarks/{clip}/{variant}/reconstruction.tsv"
    conda:
        "../../envs/scene.yaml"
    threads: 2
    resources:
        mem_mb=growing(4000),
        gpu=0,
    params:
        settings=settings("reconstruction"),
        code=code("reconstruction"),
    shell:
        'python "$SURGISIM/workflow/lease.py" {resources.gpu} python "$SURGISIM/stages/reconstruction.py"'
        " --frames {input.frames} --inpainted {input.inpainted} --masks {input.masks}"
        " --correspondence {input.correspondence} --depth {input.depth} --camera {input.camera}"
        " --scene {output.scene} --deformation {output.deformation} --rendered {output.rendered}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule thickening:
    input:
        scene=upstream("reconstruction", "scene.ply"),
        camera=upstream("ingest", "camera.json"),
    output:
        body="results/{clip}/{variant}/thickening/body.npz",
        points="results/{clip}/{variant}/thickening/body.ply",
        mesh="results/{clip}/{variant}/thickening/body_mesh.ply",
    log:
        "logs/{clip}/{variant}/thickening.log",
    benchmark:
        "benchmarks/{clip}/{variant}/thickening.tsv"
    conda:
        "../../envs/scene.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        settings=settings("thickening"),
        code=code("thickening"),
    shell:
        'python "$SURGISIM/stages/thickening.py"'
        " --scene {input.scene} --camera {input.camera}"
        " --body {output.body} --points {output.points} --mesh {output.mesh}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"
