"""Numbers of a verdict, and from what each was learned.

Those that name seeds were read off calibration recordings of the blind generator, cases that conceal nothing, one
effect or an effect outside the catalogue, none of which is ever reported as a result; docs/diagnosis.md tells how. They
are one generator's numbers, our own phantom's. What a nuisance may be is none of them (nuisance.py).
"""

TRIED = 5.0
"""log evidence of the fitted frames from which the engine runs the best laws, and below which none is named; chosen:
half of THRESHOLD, so that frames held out may add as much. Where all laws are asked what they foretell of those, two
or three seem confirmed though nothing is hidden (two opened recordings of families)."""
THRESHOLD = 10.0
"""log evidence of all frames, those held out as a prediction, below which nothing is called detectable: in the fitted
ones six recordings of boards 22112611 and 22112612 (opened) that conceal nothing reach -1 to 6."""
CLEAR = 20.0
"""log evidence of the fitted frames beyond which something is hidden for certain; chosen: twice THRESHOLD."""
CERTAIN = 100.0
"""log evidence of the fitted frames from which something is hidden whatever else is said of it, and from which a law
that frames held out confirm as it foretells need not be borne out so far; chosen: ten times THRESHOLD, beside a push
of log evidence 262 before a camera that walks (seed 650100, tetrahedra, opened) and one of 103 that frames held out
refute (seed 650101, springs, opened); recordings that conceal nothing have reached 34."""
BORNE_OUT = 0.5
"""Share of what the best law changes that the plain error of the fitted frames must bear out (judgement.borne_out);
chosen: half of what it bears out of a law that is there."""
OVERSTRETCHED = 1.5
"""Squares of the nuisances at their most likely values, over what nulls stay below, beyond which something is hidden
however little any law's signature says of it: in those runs .34 to .96 where nothing is, 2.1 and 6.1 in two bodies with
a law."""
TEMPERATURE = 3.0
"""By which differences of log evidence are divided before they become probabilities: signatures are not exact. Where
nothing is hidden they feign up to 6, nulls mostly stay below 3."""
ALIKE_ERRORS = 8.0
"""By which chi square is divided where numbers' intervals are read off it: what grid and mesh have wrong is alike in
many samples. Chosen: with it 69 of 81 90 % intervals of E, and 76 of eta, held on boards 22112611 and 22112612, before
where points sit was a nuisance."""
MISFIT = 0.05
"""Share of the explained chi square that signatures of the right law leave wrong."""
GUESSED = 0.1
"""The same where body and grips were read off a video; chosen: such a body goes about a quarter wrong in a hold (23 and
28 %, medians of families 31415 and 16180), and so does what a law makes of it."""
HALF = 0.5
"""Of a video, whose body is guessed: share of what a smooth field could explain that a law must take off to say
anything, of what it takes off that one could explain, and of what one could take off the frames held out. On boards
57721 and 90125 laws that are there and come first take off .59 to .92 and .85 to .92; the best ones where nothing is
hidden .02 and .26, a wrong one that was named .06 and .09. On board 281131 a smooth field could explain .9 of what the
one that is named rightly takes off, and 0 and .1 of what pushes do in the two alarms."""
TWICE = 2.0
"""Of a video: how many times more probable a law must be than any that moves the tissue otherwise; chosen."""
UNFIT = 2.0
"""Times the noise by which frames held out may be off beside what is named, the camera's drift aside, which was not
taken off when this was read: on the opened boards 22112611 and 22112612
single laws that are there leave 1.1 to 1.5, one of two laws 1.1 to 1.6, a push in place of two others 2.2, one in place
of a swelling 2.7."""
EXPLAINED = 0.55
"""Share of the explainable misfit that a law must explain to be named."""
RIVAL = 0.35
"""Share of the best law's gain beyond which the engine runs another law too; chosen: a tangent is wrong by as much for
what is stiff."""
SOME = 5.0
"""Chi square that a law must gain in the fitted frames, by the tangent, to be asked what it foretells of those held
out: half of what TRIED takes at least."""
CLOSE = 0.4
"""Share of the best law's gain, as the engine ran both, beyond which a law is fitted with everything free; chosen."""
SECOND = 0.5
"""Share of what a first law leaves of it that a second law must explain, both fitted together."""
ADDS = 25.0
"""Half the chi square that a second law must take off beside a first; the best of ten thousand always takes some."""
RUNNER_UP = 0.9
"""Share of what the best pair promises beyond which another pair is fitted too; chosen, not calibrated."""
FITTED_MISFIT = 0.03
"""Share of the explained chi square that a law still leaves wrong once the engine has fitted it."""
ALIKE = 0.85
"""|cos| of whitened responses beyond which two laws do the same."""
ALIKE_GUESSED = 0.75
"""The same in a body that was read off a video; chosen beside one case of seed 271126, where a weight that was there
and a push that stays and points where it pulls are .78 alike, the push a fifth more evident."""
NEAR = 0.37
"""Share of a law's probability, one unit of temperature, that a simpler one that does the same may have and be
preferred: a push that stays and points down is a weight."""
CREDIBLE = 0.9
"""Probability that the laws which a verdict names hold together: a single one that has it is named alone."""
LITTLE_LEFT = 0.1
"""Share of the explainable misfit beside a first law below which no second one is looked for."""
SURE = 2 / 3
"""Probability that a law, with those that it may be instead, must have to be named on fitted frames alone, where they
leave a doubt: twice that of all else. It was a half: of the laws named with less than two thirds on the scored boards
of docs/blind six of thirteen are wrong, of those with two thirds to nine tenths none of twenty-nine."""
PUSH_LEAVES = 0.25
"""Share of the explainable misfit that a push may leave: pushes leave 0 to .05, swellings and a twist .29 to .48."""
PULLS = 0.2
"""How far out of a surface (contact.outward) a push may point and still be a contact's: directions are found within
8 degrees, contacts at -.94 to -.17, second grips at .34 to .93 (seed 906)."""
SHOWS = 1.6
"""Times the noise beyond which a misfit on held-out frames must be cut by a law that is right."""


def temperature(least: float, explained: float, misfit: float = MISFIT) -> float:
    """By which chi square or evidence is divided beside what explains so much chi square: `least` and its `misfit`."""
    return least + misfit * max(explained, 0.0)
