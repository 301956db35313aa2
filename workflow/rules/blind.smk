"""Recordings that conceal some physics. What they conceal goes where no rule that diagnoses reads."""

import json


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
        "logs/blind/{seed}/{case}.log",
    benchmark:
        "benchmarks/blind/{seed}/{case}.tsv"
    wildcard_constraints:
        seed=r"\d+",
        case=r"\d+",
    conda:
        "../../envs/physics.yaml"
    resources:
        mem_mb=2000,
    params:
        settings=lambda w: json.dumps({"seed": int(w.seed), "case": int(w.case)}),
        code=code("invent"),
    shell:
        'python "$SURGISIM/stages/invent.py"'
        " --recording {output.recording} --rest {output.rest} --fixed {output.fixed} --grip {output.grip}"
        " --tracks {output.tracks} --split {output.split} --seal {output.seal}"
        " --truth {output.truth} --truth-tracks {output.truth_tracks} --salt {output.salt}"
        " --settings {params.settings:q} --code {params.code} > {log} 2>&1"
