# The moving scene and the body: reconstruction, thickening. Written by `make config`. Build from the checkout: docker build -f envs/scene.Dockerfile .
# The checkout itself is not in it: jobs have it bound, so an edit makes no image stale.
ARG BASE=python:3.11-slim-bookworm
FROM ${BASE}
# TORCH may name a build, "torch==2.13.0 --index-url https://download.pytorch.org/whl/cpu"; EXTRA adds what a GPU serves,
# gsplat==1.5.3.
ARG TORCH=torch==2.13.0
ARG EXTRA=
# Threads of numba's loops; its own pool ends a process in which two of them meet.
RUN apt-get update && apt-get install -y --no-install-recommends libgomp1 && rm -rf /var/lib/apt/lists/*
COPY envs/scene.txt /tmp/
RUN pip install --no-cache-dir --require-hashes --no-deps -r /tmp/scene.txt \
 && pip install --no-cache-dir ${TORCH} ${EXTRA} \
 && rm /tmp/scene.txt
