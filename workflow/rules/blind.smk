"""Recordings that conceal some physics: invented, sealed, diagnosed, and only then opened and scored.

`snakemake blind --config cases=40 seed=7`. What they conceal lies in sealed/, which the rule `score` alone reads.
With tier=video a case is an mp4, which goes through the whole graph before what became of it is diagnosed; with the
name of a family (surgisim/phantom/families) as tier, another solver's bodies, grips, cameras and noise.
"""


wildcard_constraints:
    seed=rf"(video-|{'|'.join(f'{name}-' for name in FAMILIES)})?\d+",
    case=r"\d+",
    way="|".join(WAYS),
    shorter="|".join(SHORTER),
    side=r"ablations|phases",


rule invent:
    output:
        recording="blind/{seed}/{case}/recording/recording.json",
        rest="blind/{seed}/{case}/recording/rest.ply",
        fixed="blind/{seed}/{case}/recording/fixed.json",
        grip="blind/{seed}/{case}/recording/grip.npz",
        tracks="blind/{seed}/{case}/recording/tracks.npz",
        split="blind/{seed}/{case}/recording/split.json",
        seal="blind/{seed}/{case}/seal.txt",
        truth="blind/{seed}/{case}/sealed/truth.json",
        truth_tracks="blind/{seed}/{case}/sealed/truth.npz",
        salt="blind/{seed}/{case}/sealed/salt.txt",
    log:
        "logs/blind/{seed}/{case}/invent.log",
    benchmark:
        "benchmarks/blind/{seed}/{case}/invent.tsv"
    wildcard_constraints:
        seed=rf"({'|'.join(f'{name}-' for name in FAMILIES)})?\d+",
    conda:
        "../../envs/physics.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        settings=inventing,
        code=code("invent"),
    shell:
        'python "$SURGISIM/stages/invent.py"'
        " --recording {output.recording} --rest {output.rest} --fixed {output.fixed} --grip {output.grip}"
        " --tracks {output.tracks} --split {output.split} --seal {output.seal}"
        " --truth {output.truth} --truth-tracks {output.truth_tracks} --salt {output.salt}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule invent_clip:
    output:
        clip="blind/{seed}/{case}/clip.mp4",
        seal="blind/{seed}/{case}/seal.txt",
        truth="blind/{seed}/{case}/sealed/truth.json",
        truth_tracks="blind/{seed}/{case}/sealed/truth.npz",
        salt="blind/{seed}/{case}/sealed/salt.txt",
    log:
        "logs/blind/{seed}/{case}/invent_clip.log",
    benchmark:
        "benchmarks/blind/{seed}/{case}/invent_clip.tsv"
    wildcard_constraints:
        seed=r"video-\d+",
    conda:
        "../../envs/physics.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        settings=inventing,
        code=code("invent_clip"),
    shell:
        'python "$SURGISIM/stages/invent_clip.py"'
        " --clip {output.clip} --seal {output.seal}"
        " --truth {output.truth} --truth-tracks {output.truth_tracks} --salt {output.salt}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule seals:
    input:
        seal=every("blind/{seed}/{case}/seal.txt"),
    output:
        seals="blind/{seed}/seals.txt",
    log:
        "logs/blind/{seed}/seals.log",
    benchmark:
        "benchmarks/blind/{seed}/seals.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(500),
    params:
        code=code("seals"),
    shell:
        'python "$SURGISIM/stages/seals.py"'
        " --seal {input.seal} --seals {output.seals} --code {params.code} > {log} 2>&1"


rule shuffle:
    input:
        recording=[f"blind/{{seed}}/{{case}}/recording/{name}" for name in FILES],
        other=others,
    output:
        recording="blind/{seed}/{case}/shuffled/recording/recording.json",
        rest="blind/{seed}/{case}/shuffled/recording/rest.ply",
        fixed="blind/{seed}/{case}/shuffled/recording/fixed.json",
        grip="blind/{seed}/{case}/shuffled/recording/grip.npz",
        tracks="blind/{seed}/{case}/shuffled/recording/tracks.npz",
        split="blind/{seed}/{case}/shuffled/recording/split.json",
    log:
        "logs/blind/{seed}/{case}/shuffle.log",
    benchmark:
        "benchmarks/blind/{seed}/{case}/shuffle.tsv"
    conda:
        "../../envs/physics.yaml"
    resources:
        mem_mb=growing(1000),
    params:
        own=folder,
        other=lambda w, input: Path(input.other[0]).parent,
        code=code("shuffle"),
    shell:
        'python "$SURGISIM/stages/shuffle.py" --recording {params.own} --other {params.other}'
        " --shuffled {output.recording} --rest {output.rest} --fixed {output.fixed} --grip {output.grip}"
        " --tracks {output.tracks} --split {output.split} --code {params.code} > {log} 2>&1"


rule shorten:
    input:
        recording=whole,
    output:
        recording="blind/{seed}/{case}/{shorter}/recording/recording.json",
        rest="blind/{seed}/{case}/{shorter}/recording/rest.ply",
        fixed="blind/{seed}/{case}/{shorter}/recording/fixed.json",
        grip="blind/{seed}/{case}/{shorter}/recording/grip.npz",
        tracks="blind/{seed}/{case}/{shorter}/recording/tracks.npz",
        split="blind/{seed}/{case}/{shorter}/recording/split.json",
    log:
        "logs/blind/{seed}/{case}/{shorter}/shorten.log",
    benchmark:
        "benchmarks/blind/{seed}/{case}/{shorter}/shorten.tsv"
    conda:
        "../../envs/physics.yaml"
    resources:
        mem_mb=growing(1000),
    params:
        recording=folder,
        settings=lambda w: json.dumps({"end": SHORTER[w.shorter]}),
        code=code("shorten"),
    shell:
        'python "$SURGISIM/stages/shorten.py" --recording {params.recording}'
        " --shortened {output.recording} --rest {output.rest} --fixed {output.fixed} --grip {output.grip}"
        " --tracks {output.tracks} --split {output.split}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule diagnosis:
    input:
        recording=shown,
        # Of all cases: nobody diagnoses before every answer is fixed. More cases later do not undo what is diagnosed.
        seals=ancient("blind/{seed}/seals.txt"),
    output:
        diagnosis="blind/{seed}/{case}/{way}/diagnosis.json",
        physics="blind/{seed}/{case}/{way}/physics.json",
        mismatch="blind/{seed}/{case}/{way}/mismatch.npz",
        cloud="blind/{seed}/{case}/{way}/mismatch.ply",
    log:
        "logs/blind/{seed}/{case}/{way}/diagnosis.log",
    benchmark:
        "benchmarks/blind/{seed}/{case}/{way}/diagnosis.tsv"
    conda:
        "../../envs/physics.yaml"
    threads: 2
    resources:
        mem_mb=growing(4000),
        gpu=0,
    params:
        recording=folder,
        settings=placed(diagnosing, "diagnosis"),
        work=work,
        code=code("diagnosis"),
    shell:
        'python "$SURGISIM/workflow/lease.py" {resources.gpu} python "$SURGISIM/stages/diagnosis.py"'
        " --recording {params.recording} --diagnosis {output.diagnosis} --physics {output.physics}"
        " --mismatch {output.mismatch} --cloud {output.cloud} --work {params.work}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"
        " && rm -rf {params.work}"


rule diagnosis_report:
    input:
        recording=shown,
        diagnosis="blind/{seed}/{case}/{way}/diagnosis.json",
        physics="blind/{seed}/{case}/{way}/physics.json",
        mismatch="blind/{seed}/{case}/{way}/mismatch.npz",
    output:
        page="blind/{seed}/{case}/{way}/diagnosis.html",
    log:
        "logs/blind/{seed}/{case}/{way}/diagnosis_report.log",
    benchmark:
        "benchmarks/blind/{seed}/{case}/{way}/diagnosis_report.tsv"
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


rule score:
    input:
        recording=shown,
        diagnosis="blind/{seed}/{case}/{way}/diagnosis.json",
        physics="blind/{seed}/{case}/{way}/physics.json",
        mismatch="blind/{seed}/{case}/{way}/mismatch.npz",
        seal="blind/{seed}/{case}/seal.txt",
        seals=ancient("blind/{seed}/seals.txt"),
        truth="blind/{seed}/{case}/sealed/truth.json",
        truth_tracks="blind/{seed}/{case}/sealed/truth.npz",
        salt="blind/{seed}/{case}/sealed/salt.txt",
        camera=camera,
    output:
        score="blind/{seed}/{case}/{way}/score.json",
    log:
        "logs/blind/{seed}/{case}/{way}/score.log",
    benchmark:
        "benchmarks/blind/{seed}/{case}/{way}/score.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(1000),
    params:
        recording=folder,
        camera=lambda w, input: f"--camera {input.camera}" if input.camera else "",
        code=code("score"),
    shell:
        'python "$SURGISIM/stages/score.py" --recording {params.recording}'
        " --diagnosis {input.diagnosis} --physics {input.physics} --mismatch {input.mismatch}"
        " --seal {input.seal} --seals {input.seals}"
        " --truth {input.truth} --truth-tracks {input.truth_tracks} --salt {input.salt}"
        " {params.camera} --score {output.score} --code {params.code} > {log} 2>&1"


rule scoreboard:
    input:
        score=every("blind/{seed}/{case}/{way}/score.json"),
        recording=recordings,
        pages=every("blind/{seed}/{case}/{way}/diagnosis.html"),
    output:
        board="blind/{seed}/{way}/scoreboard.json",
        table="blind/{seed}/{way}/scoreboard.csv",
        page=report(
            "blind/{seed}/{way}/scoreboard.html",
            caption="../report/scoreboard.rst",
            category="concealed recordings",
            labels={"seed": "{seed}", "way": "{way}"},
        ),
    log:
        "logs/blind/{seed}/{way}/scoreboard.log",
    benchmark:
        "benchmarks/blind/{seed}/{way}/scoreboard.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(2000),
    params:
        recording=lambda w, input: [Path(path).parent for path in input.recording],
        settings=lambda w: json.dumps(
            {"pages": f"../{{case}}/{w.way}/diagnosis.html", "seals": COUNT}
        ),
        code=code("scoreboard"),
    shell:
        'python "$SURGISIM/stages/scoreboard.py" --score {input.score} --recording {params.recording}'
        " --board {output.board} --table {output.table} --page {output.page}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule blind:
    input:
        f"blind/{room(SEED)}/main/scoreboard.html",


rule pooled:
    input:
        boards=expand("blind/{seed}/main/scoreboard.json", seed=map(room, SEEDS)),
    output:
        board="blind/pooled/scoreboard.json",
        table="blind/pooled/scoreboard.csv",
        page=report(
            "blind/pooled/scoreboard.html",
            caption="../report/scoreboard.rst",
            category="concealed recordings",
            labels={"seed": "all", "way": "main"},
        ),
    log:
        "logs/blind/pooled.log",
    benchmark:
        "benchmarks/blind/pooled.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(1000),
    params:
        settings=lambda w: json.dumps(
            {"pages": f"../{room('{seed}')}/{{case}}/main/diagnosis.html"}
        ),
        code=code("pooled"),
    shell:
        'python "$SURGISIM/stages/pooled.py" --boards {input.boards}'
        " --board {output.board} --table {output.table} --page {output.page}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule blind_pooled:
    input:
        "blind/pooled/scoreboard.html",


rule blind_shuffled:
    input:
        f"blind/{room(SEED)}/shuffled/scoreboard.html",


rule ablations:
    input:
        board=lambda w: expand(
            "blind/{seed}/{way}/scoreboard.json", seed=w.seed, way=BESIDE[w.side]
        ),
    output:
        table="blind/{seed}/{side}.json",
        page="blind/{seed}/{side}.html",
    log:
        "logs/blind/{seed}/{side}.log",
    benchmark:
        "benchmarks/blind/{seed}/{side}.tsv"
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(1000),
    params:
        settings=lambda w: json.dumps({"ways": BESIDE[w.side]}),
        code=code("ablations"),
    shell:
        'python "$SURGISIM/stages/ablations.py" --board {input.board}'
        " --table {output.table} --page {output.page}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule blind_ablations:
    input:
        f"blind/{room(SEED)}/ablations.html",


rule blind_phases:
    input:
        f"blind/{room(SEED)}/phases.html",


# One family of generators left out of what is learned, each in its turn: `snakemake blind_across --config cases=24 seed=7`.
EVERY_FAMILY = ("blocks", *FAMILIES)


rule across:
    input:
        boards=[
            f"blind/{'' if family == 'blocks' else f'{family}-'}{{number}}/main/scoreboard.json"
            for family in EVERY_FAMILY
        ],
    output:
        table="blind/across/{number}.json",
        page=report(
            "blind/across/{number}.html",
            caption="../report/scoreboard.rst",
            category="concealed recordings",
            labels={"seed": "{number}", "way": "one generator left out"},
        ),
    log:
        "logs/blind/across/{number}.log",
    benchmark:
        "benchmarks/blind/across/{number}.tsv"
    wildcard_constraints:
        number=r"\d+",
    conda:
        "../../envs/report.yaml"
    resources:
        mem_mb=growing(1000),
    params:
        settings=json.dumps({"families": list(EVERY_FAMILY)}),
        code=code("across"),
    shell:
        'python "$SURGISIM/stages/across.py" --boards {input.boards}'
        " --table {output.table} --page {output.page}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"


rule blind_across:
    input:
        f"blind/across/{SEED}.html",
