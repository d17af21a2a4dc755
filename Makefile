# All commands for users and developers; they need only Python and make. `make help` lists them.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
# Run tests on all cores, all tests of a file on one core: they share fixtures. tests/conftest.py orders
# the files.
BY_FILE := --numprocesses auto --dist loadfile --no-loadscope-reorder

# Keep compiled modules: tests start many commands.
unexport PYTHONDONTWRITEBYTECODE
test test-quick test-heavy test-long test-times coverage: export OPENBLAS_NUM_THREADS := 1

# The tests of the report page need a browser. Without a browser, make skips these tests and prints a
# warning as its last line. `.ci/run` installs a browser.
BROWSER := $(shell command -v chromium || command -v chromium-browser || command -v google-chrome)
BROWSERLESS := $(if $(BROWSER),,not browser)
AND_BROWSERLESS := $(if $(BROWSER),, and not browser)
SAY_BROWSERLESS := $(if $(BROWSER),:,echo "WARNING: Chromium is not installed: the browser tests of the page were LEFT OUT")

# The results of the paper's cases.
PAPER := $(patsubst configs/paper/%.yaml,results/%.h5,$(wildcard configs/paper/*.yaml))

SITE := build/site

.DEFAULT_GOAL := help
.PHONY: help install run test test-quick test-heavy test-long test-times mutants soak check format bench bench-peers \
	figures docs docs-links docs-outputs coverage clean

help:  ## list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## */\t/' | expand -t 14

install: $(READY)  ## create .venv with the command rbstab

# Runs again when the dependencies change. The stamp is written last, so that a broken installation
# never counts as complete.
$(READY): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit("rbstab needs Python 3.11 or newer") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $(READY)

run: $(READY)  ## run the paper's cases, prove where they converge, and write a report
	$(BIN)/rbstab run configs/paper/*.yaml
	$(BIN)/rbstab report $(PAPER) -o results/report.html

test: $(READY)  ## run the tests before each commit: all but the heavy and the long ones
	$(BIN)/python -m pytest $(BY_FILE) -m 'not heavy and not long$(AND_BROWSERLESS)'
	@$(SAY_BROWSERLESS)

test-quick: $(READY)  ## run the tests for daily use, in less than a minute: the quick ones, half of all
	$(BIN)/python -m pytest $(BY_FILE) -m 'not slow and not heavy and not long$(AND_BROWSERLESS)'
	@$(SAY_BROWSERLESS)

test-heavy: $(READY)  ## run the tests that `make test` leaves out, without the long ones (MINUTES=N: for N minutes)
	$(BIN)/python -m pytest $(BY_FILE) -m 'heavy and not long$(AND_BROWSERLESS)' $(if $(MINUTES),--minutes $(MINUTES))
	@$(SAY_BROWSERLESS)

test-long: $(READY)  ## run all tests, with hundreds of kills, full disks and faults; this takes hours
	$(BIN)/python -m pytest $(BY_FILE) -m '$(BROWSERLESS)'
	@$(SAY_BROWSERLESS)

test-times: $(READY)  ## run all tests but the long ones, and store how long each takes
	$(BIN)/python -m pytest $(BY_FILE) -m 'not long$(AND_BROWSERLESS)' --junitxml=.pytest_cache/times.xml
	PYTHONPATH=tests $(BIN)/python -m support.measure .pytest_cache/times.xml

mutants: $(READY)  ## run the tests against wrong programs, and list those that no test notices (ROOMS="mechanics ...")
	PYTHONPATH=tests $(BIN)/python -u -m support.mutants $(ROOMS)

soak: $(READY)  ## sweep 10^6 members while workers are killed; check results and memory
	PYTHONPATH=tests $(BIN)/python -u -m support.soak

check: $(READY)  ## check lint, format, types and floors
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(READY)  ## format the code
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(READY)  ## run the benchmarks; with BEFORE=COMMIT: commands and engines beside those of COMMIT
	$(BIN)/python -m benchmarks $(BEFORE)

bench-peers: $(READY)  ## measure other programs on the same problem; write the table in docs/performance.md
	$(BIN)/python -m benchmarks.peers

figures: $(READY)  ## make the figures of the documentation, and print its tables
	$(BIN)/python docs/figures/sliding.py
	$(BIN)/python docs/figures/elements.py
	$(BIN)/python docs/figures/inputs.py
	$(BIN)/python docs/figures/report.py
	$(BIN)/python docs/figures/system.py
	$(BIN)/python docs/figures/angles.py
	$(BIN)/python docs/figures/tutorials.py
	$(BIN)/python docs/figures/gallery.py

docs: $(READY)  ## write the tables of quantities; build the site, with warnings as errors
	$(BIN)/python docs/quantity_tables.py
	rm -rf $(SITE)
	$(BIN)/python -m sphinx -q -W --keep-going -E -d build/doctrees -b html docs $(SITE)
	$(BIN)/python docs/site_links.py $(SITE)
	@echo "open $(SITE)/index.html"

docs-links: $(READY)  ## check the external links of the site; this needs a network
	$(BIN)/python -m sphinx -q -W --keep-going -d build/doctrees -b linkcheck docs build/links

docs-outputs: $(READY)  ## run the commands of the pages, and write what they print into the pages
	PYTHONPATH=tests $(BIN)/python -m support.page_sessions

coverage: $(READY)  ## run the tests of `make test` with coverage; the figure is the last line, pages are in build/coverage
	$(BIN)/python -m pytest $(BY_FILE) -m 'not heavy and not long$(AND_BROWSERLESS)' \
		--cov --cov-report=html:build/coverage --cov-report=term:skip-covered

clean:  ## remove .venv, .peers and the caches of the tools
	rm -rf $(VENV) .peers build dist .coverage* .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
