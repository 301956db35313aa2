"""The material point method: total-Lagrangian, with a checkpointed adjoint.

Weights are fixed in the rest configuration, so the velocity may stay on the grid's nodes from
step to step instead of being carried to the particles and back: the transfer, and with it its
numerical damping, disappears, nobody crosses a cell and nothing tears by itself. Particles are
the places where the laws are evaluated.
"""
