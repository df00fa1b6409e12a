# Needs Python 3.11 or later and make, nothing else. Without make: see README.md.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.DEFAULT_GOAL := help
.PHONY: help setup setup-dev demo demo-fleet test system commands timed check lint format bench site packages

# Tests run side by side: threads inside each would only get in each other's way. One program more
# than two cores have, because some tests wait for others; those by the clock mostly wait.
test commands timed: export OMP_NUM_THREADS = 1
test commands timed: export POLARS_MAX_THREADS = 1
WORKERS ?= 3
unexport PYTHONDONTWRITEBYTECODE

help:
	@echo "make demo    set everything up and evaluate the example run"
	@echo "make demo-fleet  40 machines with planted faults, looked after for four nights (OPEN=1: the page)"
	@echo "make test    set everything up and run the tests, except the long proofs"
	@echo "make setup   the environment alone: .venv/bin/thermaxis"
	@echo "make check   format, lint, types, import contracts, all tests and proofs"
	@echo "make system  clean installs, a real browser, whole commands"
	@echo "make bench   what is fast, measured side by side"
	@echo "make site    the documentation as a site in build/site/html; searched when served: python3 -m http.server -d build/site/html"
	@echo "make packages  wheel and sdist in dist/, checked"

$(VENV)/.made:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "thermaxis needs Python 3.11 or later; name one: make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.setup: $(VENV)/.made pyproject.toml constraints.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[machine]'
	@touch $@

$(VENV)/.setup-dev: $(VENV)/.made pyproject.toml constraints.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $(VENV)/.setup $(VENV)/.setup-fleet $@

setup: $(VENV)/.setup

setup-dev: $(VENV)/.setup-dev

demo: setup
	@mkdir -p demo
	$(BIN)/thermaxis evaluate examples/x_axis_100_cycles.csv --header examples/header.toml \
		--limits examples/limits.toml --report demo/certificate.pdf --report demo/certificate.html \
		--figures demo/figures --json demo/results.json
	@echo "The certificate is demo/certificate.pdf; the same as a page: demo/certificate.html"

$(VENV)/.setup-fleet: $(VENV)/.setup
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[fleet]'
	@touch $@

demo-fleet: export OMP_NUM_THREADS = 1
demo-fleet: $(VENV)/.setup-fleet
	$(BIN)/python -m benchmarks.demo_fleet demo-fleet
	$(if $(OPEN),$(BIN)/thermaxis fleet page demo-fleet/registry.db)

TESTS := not system and not proof
check: TESTS := not system

test: setup-dev
	$(BIN)/python -m pytest -m "$(TESTS)" --ignore tests/system -n $(WORKERS) --dist loadfile -q

system: commands timed

commands: setup-dev
	$(BIN)/python -m pytest -m "system and not real_time" -n $(WORKERS) --dist loadfile -q \
		tests/system tests/scenarios tests/docs

timed: setup-dev
	$(BIN)/python -m pytest -m "system and real_time" -n 4 --dist loadfile -q tests/system

check: lint test

lint: setup-dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/basedpyright
	$(BIN)/lint-imports

format: setup-dev
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: setup-dev
	$(BIN)/python benchmarks/start_up.py
	$(BIN)/python benchmarks/many_runs.py
	$(BIN)/python benchmarks/drift_speed.py
	$(BIN)/python benchmarks/cycle_cost.py
	$(BIN)/python benchmarks/loop_cost.py

site: setup-dev
	$(BIN)/python -m docs.build_site

packages: setup-dev
	rm -rf dist
	$(BIN)/python -m build --outdir dist .
	$(BIN)/twine check --strict dist/*
	$(BIN)/check-wheel-contents dist/*.whl
