# Numbers and pages: evaluation, report, summary. Build from the checkout: docker build -f envs/report.Dockerfile .
ARG BASE=python:3.11-slim-bookworm
FROM ${BASE}
RUN pip install --no-cache-dir \
    'av>=13' \
    'jinja2>=3.1' \
    'matplotlib>=3.9' \
    'numpy>=2.0' \
    'opencv-python-headless>=4.10' \
    'pydantic>=2.9' \
    'pyyaml>=6' \
    'safetensors>=0.4' \
    'scikit-image>=0.24' \
    'scipy>=1.14' \
    'torch>=2.11,<3'
