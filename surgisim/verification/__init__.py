"""The engine compared with what is known: closed forms, other people's solutions, recordings.

One case a file. A case holds TITLE, `measure(progress, quick=False) -> dict`, `draw(result) -> Figure`
and `words(result) -> str`; one that needs data names their folder below SURGISIM_DATA in DATA. Every
other file here is what cases share.

    python -m surgisim.verification [NAME ...] --out docs/verification
"""
