PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INPUTS := pyproject.toml constraints.txt

.PHONY: demo test lint types contracts check format clean

## demo: plan, check and simulate the paper's benchmark; writes demo/
demo: $(VENV)/.core
	$(BIN)/hrsnake demo

## test: run all tests
test: $(VENV)/.all
	$(BIN)/python -m pytest

## lint, types, contracts: what CI checks besides the tests
lint: $(VENV)/.all
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell

types: $(VENV)/.all
	$(BIN)/mypy

contracts: $(VENV)/.all
	$(BIN)/lint-imports

check: lint types contracts test

format: $(VENV)/.all
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf $(VENV) demo

$(BIN)/python:
	$(PYTHON) -c 'import sys; sys.exit("hrsnake needs Python 3.11 or newer; try: make demo PYTHON=python3.11" if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV)

# A stamp is newer than what it was made from, so a changed dependency installs again.
$(VENV)/.core: $(INPUTS) | $(BIN)/python
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable .
	touch $@

$(VENV)/.all: $(INPUTS) | $(BIN)/python
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[dev,rl]'
	touch $@ $(VENV)/.core
