# Every target does its own set-up: a virtual environment, the build, the install.

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
SOURCES := $(shell find src cpp -name '*.py' -o -name '*.hpp' -o -name '*.cpp' -o -name '*.pyi') CMakeLists.txt pyproject.toml

.PHONY: demo test docs fuzz races lint audit lock mutants dist experiments wheels clean bench-paper bench-any-pose bench-verdict bench-fields \
	bench-assemble bench-odometry bench-faults bench-load

demo: $(VENV)/.installed-viz      ## simulate two scans of a room, register them, compare with the truth
	$(BIN)/fieldalign demo --output demo

test: $(VENV)/.installed-test     ## lint, types, and the whole test suite
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/pytest

docs: $(VENV)/.installed-docs     ## these pages and the API reference as a site, in build/docs
	$(BIN)/python -m sphinx -W --keep-going -q -E -d build/docs-cache docs build/docs
	@echo "open build/docs/index.html"

audit: $(VENV)-audit/bin/pip-audit  ## the locked dependencies: hashes, licences, what was taken back, known weaknesses
	$(VENV)-audit/bin/python .ci/audit.py

lock: $(VENV)-audit/bin/pip-audit   ## pins every dependency in requirements.lock; remove the file first for the newest ones
	$(VENV)-audit/bin/python .ci/audit.py --lock

# A core with sanitizers, and what builds it; atheris has wheels for Linux and macOS, and without it this fails.
SANITIZED := build/sanitized

fuzz: $(SANITIZED)/address,undefined/.built  ## a minute of odd input for readers, core and functions; docs/reliability.md
	$(BIN)/python fuzz/run.py --core $(<D) --work build/fuzz --seconds 60

races: $(SANITIZED)/thread/.built  ## many callers at once through a core with the thread sanitizer
	LD_PRELOAD=$$(g++ -print-file-name=libtsan.so) TSAN_OPTIONS=halt_on_error=1 \
		$(BIN)/python fuzz/races.py --core $(<D)

$(VENV)/.fuzzing: $(VENV)/.installed-test
	$(BIN)/pip install --quiet 'atheris>=3.0' 'nanobind>=2.4' cmake ninja
	touch $@

$(SANITIZED)/%/.built: $(VENV)/.fuzzing $(wildcard cpp/*) CMakeLists.txt
	$(BIN)/cmake -S . -B $(@D) -G Ninja -DCMAKE_MAKE_PROGRAM=$(abspath $(BIN))/ninja \
		-DPython_EXECUTABLE=$(abspath $(BIN))/python -DCMAKE_BUILD_TYPE=None -DFIELDALIGN_SANITIZE=$*
	$(BIN)/ninja -C $(@D)
	touch $@

bench-paper: $(VENV)/.installed-viz  ## the figures of the paper's method; needs ../shared/data or $FIELDALIGN_DATA
	$(BIN)/python benchmarks/paper.py --output docs/benchmarks

# The peers bring packages of their own, among them a plugin of pytest: they get an environment of their own.
bench-any-pose:                   ## search and accuracy from any pose, beside the peers; same data, two hours
	$(MAKE) VENV=$(VENV)-bench $(VENV)-bench/.installed-bench
	$(VENV)-bench/bin/python benchmarks/any_pose.py --output docs/benchmarks

bench-verdict:                    ## false and true acceptances, ROC and covariance beside the peers; an hour
	$(MAKE) VENV=$(VENV)-bench $(VENV)-bench/.installed-bench
	$(VENV)-bench/bin/python benchmarks/verdict.py --output docs/benchmarks

bench-fields:                     ## every kind of field on each other, meshes, volumes, freedoms; a quarter of an hour
	$(MAKE) VENV=$(VENV)-bench $(VENV)-bench/.installed-bench,mesh
	$(VENV)-bench/bin/python benchmarks/fields.py --output docs/benchmarks

bench-assemble:                   ## many scans: real sets and a heap of them beside the peers, a building; an hour
	$(MAKE) VENV=$(VENV)-bench $(VENV)-bench/.installed-bench,dask
	$(VENV)-bench/bin/python benchmarks/assemble.py --output docs/benchmarks

bench-odometry:                   ## real frames, simulated drives, endurance and faults, beside KISS-ICP; an hour and a half
	$(MAKE) VENV=$(VENV)-bench $(VENV)-bench/.installed-bench
	$(VENV)-bench/bin/python benchmarks/odometry.py --loops --output docs/benchmarks

EXPERIMENTS := modelnet40 shapenet success-rate efficiency density noise 3dmatch kitti kitti-trajectory ablation \
	distance-field pseudo-sets data-examples

bench-faults: $(VENV)/.installed-test  ## 240 kills at random moments of long commands; a quarter of an hour
	$(BIN)/python tests/faults/campaign.py --kills 240 --output docs/benchmarks/faults.json

bench-load: $(VENV)/.installed-test  ## 10,000 registrations, 100 threads, 50 million points; needs 6 GB; a quarter of an hour
	$(BIN)/python benchmarks/load.py --output docs/benchmarks

experiments:                      ## the paper's experiments on ../shared/data, beside the peers; half an hour
	$(MAKE) VENV=$(VENV)-bench $(VENV)-bench/.installed-bench
	for name in $(EXPERIMENTS); do $(VENV)-bench/bin/fieldalign experiment $$name --peers benchmarks/peers \
		--data $${FIELDALIGN_DATA:-../shared/data} --output docs/experiments || exit 1; done

dist: $(VENV)-dist/bin/auditwheel  ## the sdist, and a wheel built from it alone; what both hold, and which glibc the wheel needs
	rm -rf dist
	$(VENV)-dist/bin/python -m build --outdir dist .
	$(VENV)-dist/bin/python .ci/contents.py dist
	$(VENV)-dist/bin/auditwheel show dist/*.whl

mutants: $(VENV)/.installed-test   ## mutation testing of the solver, the verdict and the readers; hours
	$(BIN)/python benchmarks/mutants.py --output docs/benchmarks

wheels: $(VENV)/bin/python        ## wheels for this platform, as CI builds them
	$(BIN)/pip install --quiet cibuildwheel
	$(BIN)/cibuildwheel --output-dir dist

clean:
	rm -rf $(VENV) $(VENV)-bench $(VENV)-audit $(VENV)-dist build dist demo .mypy_cache .ruff_cache .pytest_cache

$(VENV)-audit/bin/pip-audit:
	$(PYTHON) -m venv $(VENV)-audit
	$(VENV)-audit/bin/pip install --quiet --upgrade pip pip-audit uv

$(VENV)-dist/bin/auditwheel:
	$(PYTHON) -m venv $(VENV)-dist
	$(VENV)-dist/bin/pip install --quiet --upgrade pip build auditwheel

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --upgrade pip

$(VENV)/.installed-%: $(VENV)/bin/python $(SOURCES)
	@echo "Building fieldalign and fetching what it needs ($*): a minute or so, in silence."
	$(BIN)/pip install --quiet '.[$*]'
	touch $@
