# Every target does its own set-up: a virtual environment, the build, the install.

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
SOURCES := $(shell find src cpp -name '*.py' -o -name '*.hpp' -o -name '*.cpp' -o -name '*.pyi') CMakeLists.txt pyproject.toml

.PHONY: demo test lint bench-paper wheels clean

demo: $(VENV)/.installed-viz      ## simulate two scans of a room, register them, compare with the truth
	$(BIN)/fieldalign demo --output demo

test: $(VENV)/.installed-test     ## lint, types, and the whole test suite
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/pytest

bench-paper: $(VENV)/.installed-bench  ## the figures of the paper's method; needs ../shared/data or $FIELDALIGN_DATA
	$(BIN)/python benchmarks/paper.py --output docs/benchmarks

wheels: $(VENV)/.installed-bench  ## wheels for this platform, as CI builds them
	$(BIN)/pip install --quiet cibuildwheel
	$(BIN)/cibuildwheel --output-dir dist

clean:
	rm -rf $(VENV) build dist demo .mypy_cache .ruff_cache .pytest_cache

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --upgrade pip

$(VENV)/.installed-%: $(VENV)/bin/python $(SOURCES)
	$(BIN)/pip install --quiet '.[$*]'
	touch $@
