PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OLD := .venv-oldest
INPUTS := pyproject.toml constraints.txt
MINORS := 12 13
CORE := tests/test_env.py tests/test_maze.py tests/test_planning.py tests/test_validation.py
CAMPAIGNS := mazes agreement spatial_agreement kernel_twins kernels_of_tracks degenerate fuzz_maps fuzz_files kills ctrl_c disk load

.PHONY: demo test oldest pythons audit trust notebooks docs docs-pictures kernels lint types contracts check format clean

## demo: plan, check and simulate the paper's benchmark; writes demo/
demo: $(VENV)/.core
	$(BIN)/hrsnake demo

## test: run all tests
test: $(VENV)/.all
	$(BIN)/python -m pytest --numprocesses auto --dist worksteal

## notebooks: execute the notebooks, and write them with their figures to notebooks/build/
notebooks: $(VENV)/.all
	$(BIN)/python docs/execute_notebooks.py

## docs: build the site strictly, to site/; a page for each environment is made on the way (--quiet would make it lax)
docs: $(VENV)/.all
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

## docs-pictures: draw the pictures of the environments' pages again, and their run to play
docs-pictures: $(VENV)/.all
	$(BIN)/python docs/make_environment_pictures.py

## kernels: the tests of the kernels once more as plain Python, where an index out of bounds is an error
kernels: $(VENV)/.all
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest tests/test_kernels.py tests/test_beam_rules.py tests/test_geometry.py \
		tests/test_spatial_track.py \
		tests/test_planning.py::test_the_papers_links_pass_the_benchmark_without_penetration \
		tests/test_sweep.py::test_every_vertex_is_one_link_length_from_its_start \
		tests/test_rod_bound.py::test_a_small_maze_is_decided_in_plain_python_too \
		tests/test_track.py::test_links_near_the_limit_pass_every_turn \
		tests/test_track.py::test_feeding_keeps_lengths_steps_and_the_track \
		tests/test_track.py::test_hits_and_self_crossings_are_those_of_shapely

## oldest: the world's and the planners' tests with the oldest versions that pyproject.toml allows
oldest: $(OLD)/.all
	$(OLD)/bin/python -m pytest --numprocesses auto --dist worksteal $(CORE) tests/test_workers.py

## pythons: the same with the newest versions and every other supported Python that is here
pythons:
	@for minor in $(MINORS); do \
		python=$$(ls -d $${PYENV_ROOT:-$$HOME/.pyenv}/versions/3.$$minor.*/bin/python 2>/dev/null | tail -n 1); \
		python3.$$minor --version >/dev/null 2>&1 && python=python3.$$minor; \
		if [ -z "$$python" ]; then echo "Python 3.$$minor is not here: not tested."; continue; fi; \
		echo "Python 3.$$minor:"; \
		{ [ -x .venv-3.$$minor/bin/python ] || $$python -m venv .venv-3.$$minor; } \
		&& .venv-3.$$minor/bin/python -m pip install --quiet --constraint constraints.txt --editable '.[play]' \
			pytest pytest-xdist hypothesis \
		&& .venv-3.$$minor/bin/python -m pytest --numprocesses auto --dist worksteal $(CORE) || exit 1; \
	done

## audit: ask the package index which of our pinned versions have known vulnerabilities
audit: $(BIN)/python
	$(BIN)/python -m pip install --quiet pip-audit
	$(BIN)/pip-audit --requirement constraints.txt --no-deps --disable-pip

## trust: the long campaigns behind docs/trust.md, some hours; each can be run alone, and with another --count
trust: $(VENV)/.all
	for name in $(CAMPAIGNS); do $(BIN)/python -m benchmarks.trust.$$name || exit 1; done

## lint, types, contracts: what CI checks besides the tests
lint: $(VENV)/.all
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell

types: $(VENV)/.all
	$(BIN)/mypy

contracts: $(VENV)/.all
	$(BIN)/lint-imports

check: lint types contracts test kernels

format: $(VENV)/.all
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf $(VENV) $(OLD) .venv-3.* demo site notebooks/build

$(BIN)/python:
	$(PYTHON) -c 'import sys; sys.exit("hrsnake needs Python 3.11 or newer; try: make demo PYTHON=python3.11" if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV)

# A stamp is newer than what it was made from, so a changed dependency installs again.
$(VENV)/.core: $(INPUTS) | $(BIN)/python
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[export,maps,studio]'
	touch $@

$(VENV)/.all: $(INPUTS) | $(BIN)/python
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[dev,rl]'
	touch $@ $(VENV)/.core

$(OLD)/.all: pyproject.toml constraints-oldest.txt
	$(PYTHON) -m venv $(OLD)
	$(OLD)/bin/python -m pip install --quiet --constraint constraints-oldest.txt --editable '.[rl,play]' \
		pytest pytest-xdist hypothesis
	touch $@
