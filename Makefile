# Every target sets itself up in .venv from nothing but Python 3.11+ (choose one with `make PYTHON=/path/to/python test`).

PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3 python; do \
	if $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then echo $$p; break; fi; done)
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
# Tests run in two processes; one BLAS thread each keeps them from fighting for the cores.
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1

.DELETE_ON_ERROR:
.PHONY: help demo test lint docs bench clean

help:
	@echo "make demo    (simulated) records -> calibrated model -> certificates -> build/demo/report.html"
	@echo "make test    lint, types, then all tests (import contract, doctests, docs build included)"
	@echo "make lint    ruff and mypy only"
	@echo "make docs    the documentation site in build/docs"
	@echo "make bench   the timings quoted in the documentation"
	@echo "make clean   remove everything the targets above made"

demo: $(VENV)/.installed
	rm -rf build/demo
	$(BIN)/robthermal demo --out build/demo

test: lint
	$(ONE_THREAD) $(BIN)/python -m pytest -n 2 --dist worksteal

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/mypy --config-file recheck/pyproject.toml recheck/recheck

docs: $(VENV)/.test
	$(BIN)/sphinx-build -W --keep-going -q -b html docs build/docs
	@echo "build/docs/index.html"

bench: $(VENV)/.installed
	@for script in tests/benchmarks/bench_*.py; do $(BIN)/python $$script || exit 1; done

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis

# The stamps say what the environment holds; a changed pyproject.toml renews them. recheck is the second checker.
$(VENV)/.installed: pyproject.toml recheck/pyproject.toml | $(BIN)/pip
	@echo "Installing robthermal into $(VENV) (a minute or two the first time)"
	$(PIP) --editable . --editable ./recheck
	@touch $@

$(VENV)/.test: pyproject.toml recheck/pyproject.toml | $(BIN)/pip
	@echo "Installing robthermal and its test tools into $(VENV) (a few minutes the first time)"
	$(PIP) --editable ".[test]" --editable ./recheck
	@touch $(VENV)/.installed $@

$(BIN)/pip:
	@test -n "$(PYTHON)" || { echo "robthermal needs Python 3.11 or newer and found none. Install one, or name it: make PYTHON=/path/to/python $(MAKECMDGOALS)" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); echo "Could not create $(VENV). On Debian or Ubuntu: apt install python3-venv" >&2; exit 1; }
