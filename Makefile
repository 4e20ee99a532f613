# Every target sets itself up in .venv from nothing but Python 3.11+ (choose one with `make PYTHON=/path/to/python test`).

PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3 python; do \
	if $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then echo $$p; break; fi; done)
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
# Tests run in two processes, each file in one of them, so that what a file shares is made once; one BLAS thread each
# keeps them from fighting for the cores.
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1
# Containers often forbid Python to keep compiled modules: every command that a test starts would compile all of them again.
export PYTHONDONTWRITEBYTECODE :=
# Which tests `make test` runs; with MARK= all of them, as CI does.
MARK ?= not exhaustive

.DELETE_ON_ERROR:
.PHONY: help demo test exhaustive quick lint docs bench clean

# Tests that together take less than half a minute on two cores: one or more of every package, chosen by measured times.
QUICK := tests/test_tests.py tests/test_contributing.py tests/test_language.py tests/test_project.py tests/diagnosis/test_structure.py \
	tests/signals/test_units.py tests/signals/test_record.py tests/signals/test_read_csv.py tests/signals/test_importing.py \
	tests/signals/test_formats.py tests/thermal/test_equations.py tests/thermal/test_datasheet.py tests/thermal/test_geometry.py \
	tests/thermal/test_mixing.py tests/thermal/test_effect_catalog.py tests/thermal/test_linear.py \
	tests/thermal/test_system_file.py tests/identify/test_response.py tests/identify/test_bad_input.py \
	tests/coupling/test_norms.py tests/coupling/test_factors.py tests/design/test_linearization.py tests/certify/test_weights.py \
	tests/report/test_verdict.py tests/report/test_summaries.py tests/jobs/test_read_project.py \
	tests/verification/test_network.py tests/verification/test_runaway.py tests/verification/test_sentences.py

help:
	@echo "make demo    (simulated) records -> calibrated model -> certificates -> build/demo/report.html"
	@echo "make test    lint, then the tests (types, import contract, doctests, notebooks included)"
	@echo "make exhaustive   the tests that make test leaves to CI: many random draws, brute force, the site built and read"
	@echo "make quick   lint, types, import contract and fast tests, within a minute: before every commit"
	@echo "make lint    ruff and mypy only"
	@echo "make docs    the documentation site in build/docs"
	@echo "make bench   the timings quoted in the documentation, kept in docs/benchmarks.json; hours"
	@echo "make clean   remove everything the targets above made"

demo: $(VENV)/.installed
	rm -rf build/demo
	$(BIN)/robthermal demo --out build/demo

# ruff first, because it takes a second; mypy is one of the tests, beside which the other process works on.
test: $(VENV)/.test
	$(BIN)/ruff check .
	$(ONE_THREAD) $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder -m "$(MARK)"

exhaustive: $(VENV)/.test
	$(ONE_THREAD) $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder -m exhaustive tests

quick: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo
	$(ONE_THREAD) $(BIN)/python -m pytest -q -n 2 --dist loadfile --no-loadscope-reorder $(QUICK)

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/mypy --config-file recheck/pyproject.toml recheck/recheck

docs: $(VENV)/.test
	$(BIN)/sphinx-build -W --keep-going -q -b html docs build/docs
	@echo "build/docs/index.html"

bench: $(VENV)/.test
	$(ONE_THREAD) $(BIN)/python tests/benchmarks/run_benchmarks.py

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis

# The stamps say what the environment holds; a changed pyproject.toml renews them. recheck is the second checker.
$(VENV)/.installed: pyproject.toml recheck/pyproject.toml | $(BIN)/pip
	@echo "Installing robthermal into $(VENV) (a minute or two the first time)"
	$(PIP) --no-compile --editable . --editable ./recheck
	@touch $@

$(VENV)/.test: pyproject.toml recheck/pyproject.toml | $(BIN)/pip
	@echo "Installing robthermal and its test tools into $(VENV) (a few minutes the first time)"
	$(PIP) --no-compile --editable ".[test]" --editable ./recheck
	@touch $(VENV)/.installed $@

$(BIN)/pip:
	@test -n "$(PYTHON)" || { echo "robthermal needs Python 3.11 or newer and found none. Install one, or name it: make PYTHON=/path/to/python $(MAKECMDGOALS)" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); echo "Could not create $(VENV). On Debian or Ubuntu: apt install python3-venv" >&2; exit 1; }
