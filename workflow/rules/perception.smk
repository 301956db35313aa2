"""What the pixels say: instrument and tissue, what it hides, how far it is, where it goes."""


rule ingest:
    input:
        clip=recording,
    output:
        frames="results/{clip}/{variant}/ingest/frames.npz",
        camera="results/{clip}/{variant}/ingest/camera.json",
        given="results/{clip}/{variant}/ingest/given.npz",
    log:
        "logs/{clip}/{variant}/ingest.log",
    benchmark:
        "benchmarks/{clip}/{variant}/ingest.tsv"
    conda:
        "../../envs/perception.yaml"
    resources:
        mem_mb=growing(3000),
    params:
        settings=settings("ingest"),
        code=code("ingest"),
    shell:
        'python "$SURGISIM/stages/ingest.py"'
        " --clip {input.clip:q}"
        " --frames {output.frames} --camera {output.camera} --given {output.given}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule masking:
    input:
        frames=upstream("ingest", "frames.npz"),
        given=upstream("ingest", "given.npz"),
        camera=upstream("ingest", "camera.json"),
    output:
        masks="results/{clip}/{variant}/masking/masks.npz",
    log:
        "logs/{clip}/{variant}/masking.log",
    benchmark:
        "benchmarks/{clip}/{variant}/masking.tsv"
    conda:
        "../../envs/perception.yaml"
    threads: 4
    resources:
        mem_mb=growing(3000),
        gpu=0,
    params:
        settings=settings("masking"),
        code=code("masking"),
    shell:
        'python "$SURGISIM/workflow/lease.py" {resources.gpu} python "$SURGISIM/stages/masking.py"'
        " --frames {input.frames} --given {input.given} --camera {input.camera} --masks {output.masks}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule inpainting:
    input:
        frames=upstream("ingest", "frames.npz"),
        masks=upstream("masking", "masks.npz"),
    output:
        inpainted="results/{clip}/{variant}/inpainting/inpainted.npz",
    log:
        "logs/{clip}/{variant}/inpainting.log",
    benchmark:
        "benchmarks/{clip}/{variant}/inpainting.tsv"
    conda:
        "../../envs/perception.yaml"
    threads: 4
    resources:
        mem_mb=growing(3000),
        gpu=0,
    params:
        settings=settings("inpainting"),
        code=code("inpainting"),
    shell:
        'python "$SURGISIM/workflow/lease.py" {resources.gpu} python "$SURGISIM/stages/inpainting.py"'
        " --frames {input.frames} --masks {input.masks} --inpainted {output.inpainted}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule correspondence:
    input:
        frames=upstream("ingest", "frames.npz"),
        masks=upstream("masking", "masks.npz"),
    output:
        correspondence="results/{clip}/{variant}/correspondence/correspondence.npz",
    log:
        "logs/{clip}/{variant}/correspondence.log",
    benchmark:
        "benchmarks/{clip}/{variant}/correspondence.tsv"
    conda:
        "../../envs/perception.yaml"
    threads: 4
    resources:
        mem_mb=growing(3000),
    params:
        settings=settings("correspondence"),
        code=code("correspondence"),
    shell:
        'python "$SURGISIM/stages/correspondence.py"'
        " --frames {input.frames} --masks {input.masks} --correspondence {output.correspondence}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule depth:
    input:
        frames=upstream("ingest", "frames.npz"),
        inpainted=upstream("inpainting", "inpainted.npz"),
        masks=upstream("masking", "masks.npz"),
        correspondence=upstream("correspondence", "correspondence.npz"),
        given=upstream("ingest", "given.npz"),
        camera=upstream("ingest", "camera.json"),
    output:
        depth="results/{clip}/{variant}/depth/depth.npz",
    log:
        "logs/{clip}/{variant}/depth.log",
    benchmark:
        "benchmarks/{clip}/{variant}/depth.tsv"
    conda:
        "../../envs/perception.yaml"
    threads: 4
    resources:
        mem_mb=growing(3000),
        gpu=0,
    params:
        settings=settings("depth"),
        code=code("depth"),
    shell:
        'python "$SURGISIM/workflow/lease.py" {resources.gpu} python "$SURGISIM/stages/depth.py"'
        " --frames {input.frames} --inpainted {input.inpainted} --masks {input.masks}"
        " --correspondence {input.correspondence} --given {input.given} --camera {input.camera} --depth {output.depth}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule tracking:
    input:
        frames=upstream("ingest", "frames.npz"),
        masks=upstream("masking", "masks.npz"),
        correspondence=upstream("correspondence", "correspondence.npz"),
        depth=upstream("depth", "depth.npz"),
        camera=upstream("ingest", "camera.json"),
    output:
        tracks="results/{clip}/{variant}/tracking/tracks.npz",
        motion="results/{clip}/{variant}/tracking/motion.npz",
    log:
        "logs/{clip}/{variant}/tracking.log",
    benchmark:
        "benchmarks/{clip}/{variant}/tracking.tsv"
    conda:
        "../../envs/perception.yaml"
    threads: 4
    resources:
        mem_mb=growing(3000),
        gpu=0,
    params:
        settings=settings("tracking"),
        code=code("tracking"),
    shell:
        'python "$SURGISIM/workflow/lease.py" {resources.gpu} python "$SURGISIM/stages/tracking.py"'
        " --frames {input.frames} --masks {input.masks} --correspondence {input.correspondence}"
        " --depth {input.depth} --camera {input.camera} --tracks {output.tracks} --motion {output.motion}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"
