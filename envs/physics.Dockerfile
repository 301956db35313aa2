# The phantom, the fit and the simulation. Build from the checkout: docker build -f envs/physics.Dockerfile .
ARG BASE=python:3.11-slim-bookworm
FROM ${BASE}
RUN pip install --no-cache-dir \
    'av>=13' \
    'numba>=0.61' \
    'numpy>=2.0' \
    'opencv-python-headless>=4.10' \
    'pydantic>=2.9' \
    'pyyaml>=6' \
    'scipy>=1.14' \
    'torch>=2.11,<3' \
    'warp-lang>=1.10'
