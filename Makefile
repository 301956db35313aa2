# make demo              set up once, run the whole graph on the embedded clip, say where the report is
# make demo VIDEO=clip.mp4 [OUT=folder]    the same on your own clip
# make test              all but the slow tests;  make test-slow   those;  make test-all   both
# make lint              style; CI runs all of these
# make config            rewrite config/config.yaml and config/schemas/ from the settings models, envs/ from the lock
# make lock              choose the newest fitting versions anew and write requirements.txt; then make config

BIN := .venv/bin
OUT ?= .
ARGS ?=

.PHONY: demo test test-slow test-all lint config lock setup clean
.DEFAULT_GOAL := demo

setup:
	@bash envs/setup.sh

demo: setup
	@$(BIN)/surgisim $(if $(VIDEO),run "$(VIDEO)",demo) --out "$(OUT)" $(ARGS)

# Files in the order of tests/conftest.py, the longest first: with a worker each, a long one at the end would run alone.
PYTEST := $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

test: setup
	@$(PYTEST) -m "not slow" $(ARGS)

test-slow: setup
	@$(PYTEST) -m slow $(ARGS)

test-all: setup
	@$(PYTEST) $(ARGS)

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check workflow
	$(BIN)/snakemake --snakefile workflow/Snakefile --lint

config: setup
	$(BIN)/python -m surgisim.config.whole config
	$(BIN)/python -m surgisim.environments envs

lock: setup
	$(BIN)/python -m pip install -q uv
	$(BIN)/python -m uv pip compile pyproject.toml --universal --python-version 3.11 --extra develop --extra learned --extra slurm --extra view \
	  --generate-hashes --no-emit-index-url --no-emit-find-links --excludes envs/excluded.txt --no-emit-package torch \
	  --custom-compile-command "make lock" --upgrade --output-file requirements.txt

clean:
	rm -rf results logs benchmarks .snakemake
