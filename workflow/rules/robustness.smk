"""Whether verdicts hold when a recording says something a frame, a millimetre or a per cent differently.

`snakemake robustness --config seed=907001 bodies=12`: a phantom's bodies, whose answers are known to whoever develops.
`snakemake metamorphic --config 'recordings=["FOLDER", ...]'`: recordings of which nobody has a key; those of known.smk
without. `before=FOLDER` puts the diagnoses that another version left in FOLDER beside either.
"""


wildcard_constraints:
    body=r"\d+",
    home=r"robustness/\d+/\d+|metamorphic/[^/]+",
    again="|".join(map(re.escape, INVENTED)),
    perturbed="|".join(map(re.escape, PERTURBED)),
    perturbation="|".join(
        map(re.escape, (AS_IS, *PERTURBED, *INVENTED, *OTHER_SETTINGS))
    ),


use rule invent as body with:
    output:
        recording="robustness/{seed}/{body}/recording/recording.json",
        rest="robustness/{seed}/{body}/recording/rest.ply",
        fixed="robustness/{seed}/{body}/recording/fixed.json",
        grip="robustness/{seed}/{body}/recording/grip.npz",
        tracks="robustness/{seed}/{body}/recording/tracks.npz",
        split="robustness/{seed}/{body}/recording/split.json",
        seal="robustness/{seed}/{body}/seal.txt",
        truth="robustness/{seed}/{body}/sealed/truth.json",
        truth_tracks="robustness/{seed}/{body}/sealed/truth.npz",
        salt="robustness/{seed}/{body}/sealed/salt.txt",
    log:
        "logs/robustness/{seed}/{body}/invent.log",
    benchmark:
        "benchmarks/robustness/{seed}/{body}/invent.tsv"
    params:
        settings=embodied,
        code=code("invent"),


use rule invent as body_again with:
    output:
        recording="robustness/{seed}/{body}/{again}/recording/recording.json",
        rest="robustness/{seed}/{body}/{again}/recording/rest.ply",
        fixed="robustness/{seed}/{body}/{again}/recording/fixed.json",
        grip="robustness/{seed}/{body}/{again}/recording/grip.npz",
        tracks="robustness/{seed}/{body}/{again}/recording/tracks.npz",
        split="robustness/{seed}/{body}/{again}/recording/split.json",
        seal="robustness/{seed}/{body}/{again}/seal.txt",
        truth="robustness/{seed}/{body}/{again}/sealed/truth.json",
        truth_tracks="robustness/{seed}/{body}/{again}/sealed/truth.npz",
        salt="robustness/{seed}/{body}/{again}/sealed/salt.txt",
    log:
        "logs/robustness/{seed}/{body}/{again}/invent.log",
    benchmark:
        "benchmarks/robustness/{seed}/{body}/{again}/invent.tsv"
    params:
        settings=embodied,
        code=code("invent"),


rule perturb:
    input:
        recording=unperturbed,
        truth=noise_free,
    output:
        recording="{home}/{perturbed}/recording/recording.json",
        rest="{home}/{perturbed}/recording/rest.ply",
        fixed="{home}/{perturbed}/recording/fixed.json",
        grip="{home}/{perturbed}/recording/grip.npz",
        tracks="{home}/{perturbed}/recording/tracks.npz",
        split="{home}/{perturbed}/recording/split.json",
    log:
        "logs/{home}/{perturbed}/perturb.log",
    benchmark:
        "benchmarks/{home}/{perturbed}/perturb.tsv"
    conda:
        "../../envs/physics.yaml"
    resources:
        mem_mb=growing(1000),
    params:
        recording=folder,
        truth=lambda w, input: f"--truth-tracks {input.truth}" if input.truth else "",
        settings=lambda w: json.dumps({"name": w.perturbed, "seed": SEED}),
        code=code("perturb"),
    shell:
        'python "$SURGISIM/stages/perturb.py" --recording {params.recording:q} {params.truth}'
        " --perturbed {output.recording} --rest {output.rest} --fixed {output.fixed} --grip {output.grip}"
        " --tracks {output.tracks} --split {output.split}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule perturbed_diagnosis:
    input:
        recording=seen,
    output:
        diagnosis="{home}/{perturbation}/diagnosis.json",
        physics="{home}/{perturbation}/physics.json",
        mismatch="{home}/{perturbation}/mismatch.npz",
        cloud="{home}/{perturbation}/mismatch.ply",
    log:
        "logs/{home}/{perturbation}/diagnosis.log",
    benchmark:
        "benchmarks/{home}/{perturbation}/diagnosis.tsv"
    conda:
        "../../envs/physics.yaml"
    threads: 2
    resources:
        mem_mb=growing(4000),
        gpu=0,
    params:
        recording=folder,
        settings=placed(diagnosing_perturbed, "perturbed_diagnosis"),
        code=code("diagnosis"),
    shell:
        'python "$SURGISIM/workflow/lease.py" {resources.gpu} python "$SURGISIM/stages/diagnosis.py"'
        " --recording {params.recording:q} --diagnosis {output.diagnosis} --physics {output.physics}"
        " --mismatch {output.mismatch} --cloud {output.cloud} --work {wildcards.home}/{wildcards.perturbation}/work"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule robustness:
    input:
        truth=of_every_body("robustness/{seed}/{body}/sealed/truth.json"),
        diagnosis=of_every_body(
            "robustness/{seed}/{body}/{perturbation}/diagnosis.json"
        ),
    output:
        table=f"robustness/{SEED}/robustness.json",
        page=report(
            f"robustness/{SEED}/robustness.html",
            caption="../report/robustness.rst",
            category="concealed recordings",
            labels={"seed": str(SEED), "way": "perturbed"},
        ),
        picture=f"robustness/{SEED}/robustness.png",
    log:
        f"logs/robustness/{SEED}/robustness.log",
    benchmark:
        f"benchmarks/robustness/{SEED}/robustness.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(1000),
    params:
        folder=lambda w, output: Path(output.table).parent,
        before=earlier(f"robustness/{SEED}"),
        settings=lambda w: json.dumps(
            {"bodies": chosen_bodies(), "perturbations": OF_BODIES}
        ),
        code=code("robustness"),
    shell:
        'python "$SURGISIM/stages/robustness.py" --folder {params.folder} {params.before}'
        " --table {output.table} --page {output.page} --picture {output.picture}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule metamorphic:
    input:
        diagnosis=expand(
            "metamorphic/{name}/{perturbation}/diagnosis.json",
            name=ASKED,
            perturbation=OF_RECORDINGS,
        ),
    output:
        table="metamorphic/metamorphic.json",
        page=report(
            "metamorphic/metamorphic.html",
            caption="../report/robustness.rst",
            category="concealed recordings",
            labels={"seed": "none", "way": "perturbed"},
        ),
    log:
        "logs/metamorphic/metamorphic.log",
    benchmark:
        "benchmarks/metamorphic/metamorphic.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(1000),
    params:
        before=earlier("metamorphic"),
        settings=json.dumps({"names": list(ASKED), "perturbations": OF_RECORDINGS}),
        code=code("metamorphic"),
    shell:
        'python "$SURGISIM/stages/metamorphic.py" --folder metamorphic {params.before}'
        " --table {output.table} --page {output.page}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"
