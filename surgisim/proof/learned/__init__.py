"""Learned backends beside the built-in ones, on recordings: what `auto` takes is decided by these tables.

python -m surgisim.proof.learned CLIPS.yaml --weights FOLDER --out docs/benchmarks
"""
