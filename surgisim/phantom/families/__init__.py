"""Families of invented recordings that differ in what computes them, and in everything else that a recording may be.

A family is a solver (`solvers/`): quadratic tetrahedra, a lattice of splines, springs; the blocks of finite elements
beside this room are one more. Body, supports, grips, courses, camera, noise and rests are drawn independently of one
another, of the solver, and of what is hidden (`world.py`, `seen.py`, `hidden.py`). Solvers implement what is hidden
each in its own way; none shares a line with the engine's laws or with the room beside.
"""
