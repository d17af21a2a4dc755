# Everything a person does here, on a machine with only Python and make. `make help` lists it.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
# Tests on all cores; those of a file together, for they share what is made once.
BY_FILE := --numprocesses auto --dist loadfile

# The page of a report is tested in a browser. A machine with only Python and make has none: there
# these tests are left out, and the last line says so; `.ci/run` installs one.
BROWSER := $(shell command -v chromium || command -v chromium-browser || command -v google-chrome)
BROWSERLESS := $(if $(BROWSER),,not browser)
SAY_BROWSERLESS := $(if $(BROWSER),:,echo "WARNING: no Chromium here: the tests of the page in a browser were LEFT OUT")

# The results of the paper's cases.
PAPER := $(patsubst configs/paper/%.yaml,results/%.h5,$(wildcard configs/paper/*.yaml))

.DEFAULT_GOAL := help
.PHONY: help install run test test-quick check format bench figures clean

help:  ## list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## */\t/' | expand -t 14

install: $(READY)  ## make .venv with the command rbstab in it

# Made again when the dependencies change. The stamp is the last thing, so that a broken installation
# is never taken for a whole one.
$(READY): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit("rbstab needs Python 3.11 or newer") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $(READY)

run: $(READY)  ## run the paper's cases, print their table, and make a report of them
	$(BIN)/rbstab run configs/paper/*.yaml
	$(BIN)/rbstab report $(PAPER) -o results/report.html

test: $(READY)  ## all tests; those in a browser where there is a Chromium
	$(BIN)/python -m pytest $(BY_FILE) -m '$(BROWSERLESS)'
	@$(SAY_BROWSERLESS)

test-quick: $(READY)  ## the tests for daily use, without those marked slow
	$(BIN)/python -m pytest $(BY_FILE) -m 'not slow$(if $(BROWSERLESS), and $(BROWSERLESS))'
	@$(SAY_BROWSERLESS)

check: $(READY)  ## lint, format, types, floors
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(READY)  ## put the code into its format
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(READY)  ## the benchmarks, as ratios within one run
	$(BIN)/python -m benchmarks

figures: $(READY)  ## make the figures of the documentation, and print the tables
	$(BIN)/python docs/figures/sliding.py
	$(BIN)/python docs/figures/report.py

clean:  ## remove .venv and what tools left
	rm -rf $(VENV) dist .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
