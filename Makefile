# `make` alone lists the targets. SETUP finds python3, fills .venv and looks after the OpenGL libraries.
SETUP := sh scripts/setup.sh
BIN   := .venv/bin
ARGS  ?=

.PHONY: help reproduce test lint bench tables docs wheel gl
.DEFAULT_GOAL := help

help:  ## this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-11s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

reproduce: .venv/ready gl  ## the paper's experiment, end to end; options by ARGS="--seed 1 --minutes 20"
	$(BIN)/somatopy reproduce $(ARGS)

test: lint gl  ## lint, then every test and every example in a docstring
	@$(SETUP) osmesa
	@$(SETUP) browser
	$(BIN)/python -m pytest --numprocesses auto --dist loadscope $(ARGS)

lint: .venv/ready-test  ## ruff and mypy
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: .venv/ready-bench  ## speed of all maps beside other packages; options by ARGS="--sides 30"
	$(BIN)/python benchmarks/maps.py $(ARGS)

tables: .venv/ready-bench  ## docs/maps/tables.md anew: the maps beside minisom on tables
	$(BIN)/python docs/compare_tables.py $(ARGS)

docs: .venv/ready-docs  ## this documentation as a site, in build/site
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo "open build/site/index.html"

wheel: .venv/ready-test  ## wheel and source archive, in dist
	$(BIN)/python -m hatchling build --directory dist

gl: | .venv/ready
	@$(SETUP) gl

.venv/ready: pyproject.toml scripts/setup.sh
	@$(SETUP) packages

.venv/ready-test: pyproject.toml scripts/setup.sh .venv/ready
	@$(SETUP) packages test

.venv/ready-docs: pyproject.toml scripts/setup.sh .venv/ready
	@$(SETUP) packages docs

.venv/ready-bench: pyproject.toml scripts/setup.sh .venv/ready
	@$(SETUP) packages bench
