#!/usr/bin/env bash
# Make .venv hold exactly what requirements.txt locks, then torch, then this checkout; do nothing when it already does.
#   PYTHON  the interpreter to build on             (default: the newest python3 that is new enough)
#   TORCH   what to ask pip for                     (default: torch==2.13.0; see README for a CPU build)
set -euo pipefail
cd "$(dirname "$0")/.."
TORCH=${TORCH:-torch==2.13.0}

key=$(cat requirements.txt pyproject.toml envs/setup.sh <(echo "$TORCH $PWD") | sha256sum | cut -d' ' -f1)
if [ -x .venv/bin/python ] && [ "$(cat .venv/.ready 2>/dev/null)" = "$key" ]; then exit 0; fi

exec 9>.setup.lock
flock 9
if [ "$(cat .venv/.ready 2>/dev/null)" = "$key" ]; then exit 0; fi

recent() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }
if [ ! -x .venv/bin/python ] || ! .venv/bin/python -m pip --version >/dev/null 2>&1; then
  for python in ${PYTHON:-python3 python3.14 python3.13 python3.12 python3.11}; do
    if recent "$python"; then break; fi
    python=
  done
  if [ -z "$python" ]; then
    echo "error: Python 3.11 or newer is needed and '${PYTHON:-python3}' is not. Install one, or name it: make demo PYTHON=/path/to/python3.12" >&2
    exit 2
  fi
  echo "setup: a virtual environment with $("$python" --version) in .venv"
  # Debian's python3 lacks ensurepip until python3-venv is installed; a system pip can stand in for it.
  "$python" -m venv .venv >/dev/null 2>&1 ||
    { "$python" -m venv --clear --without-pip .venv && "$python" -m pip --python .venv/bin/python install -q pip; } >/dev/null 2>&1 ||
    "$python" -m virtualenv -q .venv >/dev/null 2>&1 ||
    { rm -rf .venv
      echo "error: '$python' cannot make a virtual environment. On Debian or Ubuntu: apt install python3-venv; then run the same command again." >&2
      exit 2; }
fi

rm -f .venv/.ready
pip() { .venv/bin/python -m pip --disable-pip-version-check "$@"; }
echo "setup: installing what requirements.txt locks (a few minutes, once)"
pip install -qq --require-hashes --no-deps -r requirements.txt
# torch's hash depends on where its build comes from (PyPI's CUDA build, a CPU build), so only its version is locked.
# shellcheck disable=SC2086
pip install -qq $TORCH
pip install -qq --no-deps --no-build-isolation -e .
echo "$key" >.venv/.ready
echo "setup: done"
