# FlexGUI: `make run` opens the workbench, `make test` checks everything.
.DEFAULT_GOAL := help
.PHONY: help run report study docs test coverage sample long load fuzz bench evidence matrix mujoco lint format clean chromium compiled axe
MAKEFLAGS += --no-print-directory
export PIP_DISABLE_PIP_VERSION_CHECK = 1

VENV := .venv
BIN := $(VENV)/bin
SCENARIO ?= scenarios/paper_glocal.toml
OUT ?= reports/$(basename $(notdir $(SCENARIO)))
STUDY ?= studies/$(basename $(notdir $(SCENARIO)))
SEED ?= 1
# TRIES=--quick leaves out the tries that take minutes; TRIES="--items 1 3": only these items.
TRIES ?=
# Each process takes its part of the tests in their order, then some of the others': what the tests
# of a file share is made once.
SHARED := -n 2 --dist worksteal
TEXTS := README.md CHANGELOG.md docs core flexgui scenarios
# Kept from checkout to checkout, as compiled kernels are; a cold run only takes longer.
CACHE := $(or $(XDG_CACHE_HOME),$(HOME)/.cache)/flexgui/tools
export MYPY_CACHE_DIR := $(CACHE)/mypy
export RUFF_CACHE_DIR := $(CACHE)/ruff
# Every test with its seconds.
DURATIONS := reports/durations.xml
# uv brings all packages at once, ten times as quick; where it cannot, as behind a mirror that only
# pip's settings name, pip does. Python compiles what is used at its first import.
export UV_NATIVE_TLS = true
PIP := $(BIN)/python -m pip install --quiet --no-compile --constraint constraints.txt
UV := $(BIN)/uv pip install --quiet --python $(BIN)/python --constraint constraints.txt
comma := ,
# By path, as a clone named flexgui beside a script would otherwise hide the package from it.
EDITABLE := --config-settings editable_mode=compat --editable
install = $(UV) $(EDITABLE) '.[$(1)]' 2>/dev/null || $(PIP) $(EDITABLE) '.[$(1)]'

help:
	@echo "make run     the workbench in the browser"
	@echo "make report  a report from $(SCENARIO) (SCENARIO=... OUT=... for another)"
	@echo "make study   the paper's Monte Carlo study with tables, figures and baselines; goes on where it stopped"
	@echo "make docs    the site in build/site, to be read without a network"
	@echo "make test    ruff, mypy and the tests; prints the slowest and writes all durations to $(DURATIONS)"
	@echo "make sample  thirty diagnoses with a known truth beside a stored reference; goes on where it stopped"
	@echo "make long    the tests that take minutes: many seeds, every page, killed processes, real rigs"
	@echo "make load    thirty and sixty browsers for two minutes, 300 that come and go: delays, memory, leftovers"
	@echo "make fuzz    1,500 damaged recordings, scenarios, archives and command lines (SEED=... for others),"
	@echo "             then a table of all that was once open or fragile, tried again (TRIES=--quick)"
	@echo "make bench   how fast and how exact it is on this machine"
	@echo "make evidence  docs/evidence.md: published recordings, an independent engine, peers; goes on"
	@echo "make matrix  480 plain scenarios of random rigs, 100 with nothing hidden, 200 planned experiments;"
	@echo "             some hours; goes on where it stopped"
	@echo "make mujoco  the recordings of the independent engine in scenarios/mujoco, where they are missing"
	@echo "make lint    ruff, mypy, spelling, dead code and duplicates only"
	@echo "make format  let ruff put the code in order"
	@echo "make clean   remove what was made, the virtual environment too"

run: $(VENV)/.installed
	@$(BIN)/flexgui serve

report: $(VENV)/.installed
	@$(BIN)/flexgui export $(SCENARIO) --out $(OUT)
	@echo "The report lies in $(OUT)/report.html"

study: $(VENV)/.installed
	@$(BIN)/flexgui study $(SCENARIO) --out $(STUDY)

# The second line is about links and warnings: with --strict each of them ends it.
docs: $(VENV)/.installed-docs
	@$(BIN)/python docs/tools/conventions.py && $(BIN)/python docs/tools/gallery.py >/dev/null
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "The site begins with build/site/index.html"

# Matrices are small here: with threads for each product the peers took ten times as long.
bench: $(VENV)/.installed-bench
	@OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.programs.bench

# PARTS="emps peers": only these.
evidence: $(VENV)/.installed-peers
	@$(BIN)/python -m tests.programs.evidence $(PARTS)

matrix: $(VENV)/.installed-test
	@$(BIN)/python -m tests.programs.studies.nothing_hidden --workers 2
	@$(BIN)/python -m tests.programs.studies.next_experiments --workers 2
	@$(BIN)/python -m tests.programs.studies.plain_matrix --workers 2

mujoco: $(VENV)/.installed-test
	@$(BIN)/python -m tests.programs.mujoco.generate

# The browser is installed while the tools are, and while what the tests share is compiled. What lint
# has to say comes last, also where it is long done.
test:
	@$(MAKE) -j2 chromium compiled
	@said=$$(mktemp); $(MAKE) lint >$$said 2>&1 & lint=$$!; \
	$(BIN)/python -m pytest $(SHARED) --durations 25 --junit-xml $(DURATIONS) -o cache_dir=$(CACHE)/pytest; \
	tests=$$?; wait $$lint; linted=$$?; cat $$said; rm $$said; \
	echo "Seconds of every test: $(DURATIONS)"; exit $$((tests + linted))

compiled: $(VENV)/.installed-test
	@$(BIN)/python -m tests.compiled

# How many lines of core and flexgui the short tests run; compiled code counts as not run.
coverage: $(VENV)/.installed-test
	@$(BIN)/python -m pytest $(SHARED) -q --cov=flexgui --cov-report=html:build/coverage --cov-report=term:skip-covered

sample: $(VENV)/.installed-test
	@$(BIN)/python -m tests.programs.sample $(CASES)

long: $(VENV)/.installed-test axe
	@$(BIN)/python -m pytest $(SHARED) --durations 25 -m long; \
	tests=$$?; $(MAKE) docs && exit $$tests

load: $(VENV)/.installed-test
	@$(BIN)/python -m tests.programs.load

fuzz: $(VENV)/.installed-test
	@$(BIN)/python -m tests.programs.fuzz.run --seed $(SEED)
	@$(BIN)/python -m tests.programs.fuzz.tries $(TRIES)

lint: $(VENV)/.installed-test
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/codespell $(TEXTS) --skip "*.csv,*.png,*.svg,*.js"
	@$(BIN)/codespell $(TEXTS) --skip "*.csv,*.gz,*.png,*.svg,*.ipynb,glossary.md" \
	  -D tests/programs/lint/retired_words.txt --regex "[A-Za-z][a-z]+"
	@$(BIN)/python -m tests.programs.lint.dead_code
	@$(BIN)/python -m tests.programs.lint.duplicates

format: $(VENV)/.installed-test
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

clean:
	@rm -rf $(VENV) build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis
	@find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The first python that starts and is new enough; a shim that names a missing python does not.
$(VENV)/bin/python:
	@for p in python3.11 python3 python3.14 python3.13 python3.12; do \
	  if $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then found=$$p; break; fi; \
	done; \
	if [ -z "$$found" ]; then \
	  echo "FlexGUI needs Python 3.11 or newer, and none was found; install it and try again." >&2; exit 1; \
	fi; \
	if ! $$found -c 'import ensurepip, venv' 2>/dev/null; then \
	  v=$$($$found -c 'import sys; print("python%d.%d" % sys.version_info[:2])'); \
	  echo "$$found cannot make virtual environments; on Debian or Ubuntu: sudo apt-get install $$v-venv" >&2; exit 1; \
	fi; \
	echo "Making $(VENV) with $$($$found --version)"; \
	$$found -m venv $(VENV) || { rm -rf $(VENV); exit 1; }

# A stamp is newer than what it was made from: the second run installs nothing.
$(VENV)/.installed: pyproject.toml constraints.txt | $(VENV)/bin/python
	@echo "Installing FlexGUI into $(VENV) (up to a few minutes the first time)"
	@$(PIP) uv || true
	@$(call install,page)
	@touch $@

$(VENV)/.installed-test: $(VENV)/.installed
	@echo "Installing the tools of the tests"
	@$(call install,test$(comma)cluster)
	@touch $@

$(VENV)/.installed-bench: $(VENV)/.installed-test
	@echo "Installing what the benchmark compares with"
	@$(call install,bench)
	@touch $@

$(VENV)/.installed-peers: $(VENV)/.installed-test
	@echo "Installing what the evidence compares with"
	@$(call install,peers)
	@touch $@

$(VENV)/.installed-docs: $(VENV)/.installed
	@echo "Installing the tools of the site"
	@$(call install,docs)
	@touch $@

# The walk through the page lets axe-core look at it, where npm can bring it.
axe: $(VENV)/.installed-test
	@if [ ! -f $(VENV)/axe.min.js ] && command -v npm >/dev/null 2>&1; then \
	  d=$$(mktemp -d) && cd $$d && npm pack --silent axe-core@4 >/dev/null 2>&1 \
	  && tar xzf axe-core-*.tgz package/axe.min.js && cp package/axe.min.js $(CURDIR)/$(VENV)/ \
	  || echo "axe-core could not be fetched; the walk leaves it out."; \
	  rm -rf $$d; \
	fi

# Tests of the page and the report look at them in a browser; without one they are skipped.
chromium:
	@if ! command -v chromium >/dev/null 2>&1; then \
	  echo "Installing Chromium for the tests of the page"; \
	  if [ "$$(id -u)" = 0 ]; then s=; else s="sudo -n"; fi; \
	  export DEBIAN_FRONTEND=noninteractive; \
	  { $$s apt-get install -qq -y chromium || { $$s apt-get -qq update && $$s apt-get install -qq -y chromium; }; } \
	    >/dev/null 2>&1 \
	  || echo "Chromium could not be installed (no apt-get, no rights or no network); tests that need it are skipped."; \
	fi
