# The pixels: ingest, masking, inpainting, depth, tracking. Build from the checkout: docker build -f envs/perception.Dockerfile .
ARG BASE=python:3.11-slim-bookworm
FROM ${BASE}
RUN pip install --no-cache-dir \
    'av>=13' \
    'numba>=0.61' \
    'numpy>=2.0' \
    'onnxruntime>=1.20' \
    'opencv-python-headless>=4.10' \
    'pillow>=10' \
    'pydantic>=2.9' \
    'pyyaml>=6' \
    'scikit-image>=0.24' \
    'scipy>=1.14' \
    'torch>=2.11,<3' \
    'transformers>=4.49'
