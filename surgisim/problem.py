"""Bad input, said in one sentence."""


class Problem(ValueError):
    """Something the user can mend: where, what was wanted, what was found, what to do.

    The command line and every stage print it as one line and exit with code 2; a
    traceback is shown only under `--debug`.
    """
