"""What naming would reach by chance: the same verdicts, dealt out to the cases at random."""

import numpy as np

from surgisim.proof.naming import NOT_NAMED


def chance(cases: list[dict], seed: int = 0, deals: int = 4000) -> dict:
    """Share of rightly named cases when every verdict meets a random case's truth, and how often that beats the real.

    p is the probability of at least as many right names by chance: small when the names come from the recordings,
    large when they do not.
    """
    asked = [i for i, case in enumerate(cases) if case["top1"] is not None]
    if not asked:
        return {"value": None, "real": None, "p": None, "count": 0}
    first = np.array([c["ranked"][0] if c["named"] else NOT_NAMED[0] for c in cases])
    hidden = [{h["term"] for h in cases[i]["concealed"]} for i in asked]
    right = np.array([[name in wanted for name in first] for wanted in hidden])
    real = int(right[np.arange(len(asked)), asked].sum())
    rng = np.random.default_rng(seed)
    dealt = np.array(
        [right[np.arange(len(asked)), rng.permutation(len(cases))[: len(asked)]].sum() for _ in range(deals)]
    )
    return {
        "value": float(dealt.mean() / len(asked)),
        "real": real / len(asked),
        "p": float((1 + (dealt >= real).sum()) / (1 + deals)),
        "count": len(asked),
    }
