# The moving scene and the body: reconstruction, thickening. Build from the checkout: docker build -f envs/scene.Dockerfile .
ARG BASE=python:3.11-slim-bookworm
FROM ${BASE}
RUN pip install --no-cache-dir \
    'numba>=0.61' \
    'numpy>=2.0' \
    'pydantic>=2.9' \
    'pyyaml>=6' \
    'scipy>=1.14' \
    'torch>=2.11,<3'
