# `make demo`, `make test` and the others prepare .venv by themselves on a fresh machine.
# Needs Python 3.11 or newer; name another one with `make setup PYTHON=python3.12`. Those after 3.13 come last:
# xatlas has no wheels for them, and is compiled.

PYTHON ?= $(shell for newest in 13 99; do for p in python3 python3.13 python3.12 python3.11 python3.14; do \
	$$p -c "import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, $$newest))" 2>/dev/null \
	&& echo $$p && exit; done; done)
VENV := .venv
STAMP := $(VENV)/.installed

# Many a container asks Python to keep no compiled files. The tests start a hundred processes, and each would
# compile all of Mitex again.
export PYTHONDONTWRITEBYTECODE =

.PHONY: setup demo test lint docs bench clean

setup: $(STAMP)

# The last line is a start of Python: it finishes the links of the LLVM package.
$(STAMP): pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "error: no Python 3.11 or newer; install one or pass PYTHON=..." >&2; exit 2; }
	$(PYTHON) -m venv $(VENV)
	$(VENV)/bin/python -m pip install --quiet --constraint constraints.txt --editable ".[dev]"
	$(VENV)/bin/python -c "import mitex"
	@touch $@

demo: $(STAMP)
	$(VENV)/bin/mitex demo --out out/demo

# Two at a time, a thread each, of torch and of Dr.Jit: most tests have no use for two, and idle workers spin
# on the cores of the other process. Files are dealt out in their order: by the number of their tests, those
# with one long test would come last, when the other process has nothing left to do. A process that dies is
# not replaced: with `loadfile` its tests are dealt out once more, and the run may wait for ever
# (pytest-xdist 1323).
test: $(STAMP)
	OMP_NUM_THREADS=1 MITEX_THREADS=1 $(VENV)/bin/python -m pytest -m "not slow" --numprocesses 2 --dist loadfile \
		--no-loadscope-reorder --max-worker-restart 0

lint: $(STAMP)
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/pyright

# Executes the tutorial notebooks too; those that have not changed are taken from the last build's cache.
docs: $(STAMP)
	OMP_WAIT_POLICY=PASSIVE $(VENV)/bin/sphinx-build -c docs/site --fresh-env --fail-on-warning --quiet . out/docs
	$(VENV)/bin/python docs/site/check.py out/docs
	@echo "open out/docs/index.html"

bench: $(STAMP)
	$(VENV)/bin/python -m benchmarks.nca
	OMP_WAIT_POLICY=PASSIVE $(VENV)/bin/python -m benchmarks.nca_decoder
	OMP_WAIT_POLICY=PASSIVE $(VENV)/bin/python -m benchmarks.nca_motion
	OMP_WAIT_POLICY=PASSIVE $(VENV)/bin/python -m benchmarks.nca_text
	$(VENV)/bin/python -m benchmarks.surface
	$(VENV)/bin/python -m benchmarks.baselines
	$(VENV)/bin/python -m benchmarks.batch
	$(VENV)/bin/python -m benchmarks.geometric
	$(VENV)/bin/python -m benchmarks.busy
	$(VENV)/bin/python -m benchmarks.flow
	$(VENV)/bin/python -m benchmarks.living_page
	OMP_WAIT_POLICY=PASSIVE $(VENV)/bin/python -m benchmarks.nerf

clean:
	rm -rf $(VENV) out
