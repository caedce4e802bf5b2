# The two commands: `make demo` and `make test`. Both start from nothing.
SHELL := /bin/bash
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP_STAMP := $(VENV)/.pip
RUN_STAMP := $(VENV)/.installed
DEV_STAMP := $(VENV)/.installed-dev
SIMULATORS_STAMP := $(VENV)/.installed-simulators
SYSTEM_STAMP := $(VENV)/.installed-system
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PIP_ROOT_USER_ACTION := ignore
# where it is set, every one of the programs that tests start compiles all it imports
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo gui test check fast search reports screenshots clean help

help:
	@echo "make demo         install, run the paper's experiment on the simulated bench"
	@echo "make gui          install, open the bench window"
	@echo "make test         install what tests need, run every check and test"
	@echo "make fast         the unit tests alone"
	@echo "make search       the property tests on new examples, a thousand each"
	@echo "make reports      the long campaigns; rewrites the tables in docs/"
	@echo "make screenshots  pictures of the window and of the demo's figure for docs/"
	@echo "make clean        remove the environment and caches; runs/ is kept"

demo: $(RUN_STAMP)
	$(BIN)/tactile-lab run

gui: $(DEV_STAMP)
	$(BIN)/tactile-lab gui

test:
	# all that tests need is fetched side by side
	$(MAKE) --no-print-directory -j 3 $(DEV_STAMP) $(SIMULATORS_STAMP) $(SYSTEM_STAMP)
	# what is compiled is compiled once, or each worker does it; meanwhile types are
	# checked
	{ $(BIN)/python tests/support/compile_once.py >$(VENV)/compiling 2>&1 || \
	    { cat $(VENV)/compiling; exit 1; } } & compiling=$$!; \
	    $(MAKE) --no-print-directory check && wait $$compiling
	$(BIN)/python -m pytest -n auto --dist loadfile

check: $(DEV_STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

fast: $(DEV_STAMP) $(SIMULATORS_STAMP)
	$(BIN)/python -m pytest -x -q -m "not campaign" --ignore tests/gui

# what the settled examples of `make test` do not try; a find becomes an @example
search: $(DEV_STAMP) $(SIMULATORS_STAMP)
	$(BIN)/python -m pytest -q -m hypothesis --hypothesis-profile=search -n auto

# hours on two cores, alone on the machine: says how many, and goes on where it was
# stopped; every table states commit and date
reports: $(DEV_STAMP) $(SIMULATORS_STAMP)
	$(BIN)/python docs/make_reports.py

screenshots: $(DEV_STAMP)
	$(BIN)/python tests/pictures/take_pictures.py docs/pictures
	$(BIN)/tactile-lab run --out $$(mktemp -d) --json | \
	    $(BIN)/python -c 'import json, shutil, sys; from pathlib import Path; shutil.copy(Path(json.load(sys.stdin)["report"]).with_name("figure.png"), "docs/pictures/demo.png")'

clean:
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +

$(BIN)/python:
	@.ci/venv $(PYTHON) $(VENV)

$(PIP_STAMP): | $(BIN)/python
	$(BIN)/python -m pip install -q --upgrade "pip>=25.1"
	@touch $@

# compiled as it is imported: much of what comes never is
$(RUN_STAMP): pyproject.toml | $(PIP_STAMP)
	$(BIN)/python -m pip install -q --no-compile -e .
	@touch $@

$(DEV_STAMP): pyproject.toml | $(PIP_STAMP)
	$(BIN)/python -m pip install -q --no-compile -e ".[gui]" --group dev
	@touch $@ $(RUN_STAMP)

$(SIMULATORS_STAMP): pyproject.toml | $(PIP_STAMP)
	$(BIN)/python -m pip install -q --no-compile --no-deps --upgrade --target $(VENV)/simulators --group simulators
	@touch $@

$(SYSTEM_STAMP): .ci/system-packages | $(BIN)/python
	@.ci/install-system-packages
	@touch $@
