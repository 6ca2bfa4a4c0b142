# Everything lives in .venv and is made from the hashed locks; stamps in .venv say what is up to date.
PYTHON ?= python3
JOBS ?= 2
N ?= 20
BIN := .venv/bin
RUNTIME := .venv/.runtime
DEV := .venv/.dev
SITE := .venv/.site
PIP := $(BIN)/python -m pip --disable-pip-version-check install --quiet --no-compile
LOCK := $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --fork-strategy fewest \
        --generate-hashes --no-strip-extras --no-emit-index-url --custom-compile-command "make lock"

# Each module is compiled to bytecode where it is first imported: most modules of the packages never are, and a
# command that may not keep the bytecode takes twice as long to start.
unexport PYTHONDONTWRITEBYTECODE

.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

.PHONY: help
help:  ## Explain the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-14s %s\n", $$1, $$2}' Makefile

.PHONY: demo
demo: $(RUNTIME)  ## Install pzd into .venv, run configs/quickstart.yaml, say where the report lies
	$(BIN)/pzd run configs/quickstart.yaml
	@echo "The report lies in runs/quickstart/6-report/report.html"

.PHONY: test
test: $(DEV)  ## Run the tests on fixed draws, but for those that build and install the whole or take long
	$(BIN)/python -m pytest -n $(JOBS) --dist worksteal -m "not ci" --durations 10

.PHONY: check
check: $(DEV)  ## Check style (ruff), format (ruff) and types (mypy --strict)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

.PHONY: ci
ci: check $(SITE)  ## What a merge must pass besides `make test`: check, every config, the wheel installed elsewhere
	$(BIN)/python -m pytest -n $(JOBS) --dist loadfile -m ci --durations 10

.PHONY: coverage
coverage: $(DEV)  ## As `make test`, and print how many lines and branches of each module it runs; takes longer
	$(BIN)/python -m pytest -n $(JOBS) --dist worksteal -m "not ci" --cov --cov-report=term

.PHONY: fresh
fresh: $(DEV)  ## Run the tests that draw on N=20 new seeds, repeat what failed, print seed and rate per test
	$(BIN)/python tests/studies/fresh.py --seeds $(N) --jobs $(JOBS) $(TESTS)

.PHONY: figures
figures: $(RUNTIME)  ## Draw the figures of the paper into runs/paper/figures
	$(BIN)/pzd figures configs/paper.yaml

.PHONY: blind
blind: $(RUNTIME)  ## Hide effects in virtual rigs, and print how far the verdicts can be trusted; three hours
	$(BIN)/pzd blind configs/blind.yaml

.PHONY: blind-motions
blind-motions: $(RUNTIME)  ## As `make blind`, on two tones, sweeps, roads, moving voltages, warming alone; three hours
	$(BIN)/pzd blind configs/blind-motions.yaml

.PHONY: blind-edge
blind-edge: $(RUNTIME)  ## As `make blind`, at the edge of what can be seen: how far a confidence can be trusted; 15 minutes
	$(BIN)/pzd blind configs/blind-edge.yaml

.PHONY: true-dampers
true-dampers: $(DEV)  ## Hold the dampers of blind cases against their own records: what is left must be noise; five minutes
	OPENBLAS_NUM_THREADS=1 PYTHONPATH=. $(BIN)/python tests/studies/true_damper.py --cases 150

.PHONY: bench
bench: $(DEV)  ## Print each speed beside what is wanted and beside a peer that does the same work; a quarter of an hour
	$(BIN)/python tests/studies/bench.py

.PHONY: changes-study
changes-study: $(DEV)  ## Print how often `pzd changes` is right, on pairs of virtual dampers; half an hour
	OPENBLAS_NUM_THREADS=1 PYTHONPATH=. $(BIN)/python tests/studies/changes_study.py --pairs 40
	OPENBLAS_NUM_THREADS=1 PYTHONPATH=. $(BIN)/python tests/studies/changes_study.py --pairs 20 --kind stand
	OPENBLAS_NUM_THREADS=1 PYTHONPATH=. $(BIN)/python tests/studies/changes_study.py --pairs 20 --kind same

.PHONY: planted
planted: $(DEV)  ## Print what `pzd changes` and `pzd diagnose` make of forces added in software to measured tests; needs the measured data
	OPENBLAS_NUM_THREADS=1 PYTHONPATH=. $(BIN)/python tests/studies/planted.py
	OPENBLAS_NUM_THREADS=1 PYTHONPATH=. $(BIN)/python tests/studies/planted.py --diagnose

.PHONY: coverage-study
coverage-study: $(DEV)  ## Print how often the intervals of identify hold the truth; some minutes
	OPENBLAS_NUM_THREADS=1 PYTHONPATH=.:tests/identification $(BIN)/python tests/studies/coverage_study.py

.PHONY: nist
nist: $(DEV)  ## Print how the least squares do on the nonlinear regressions of NIST StRD; a second
	PYTHONPATH=.:tests/fit $(BIN)/python tests/studies/nist.py

.PHONY: plain-study
plain-study: $(DEV)  ## Measure 600 plain dampers from everywhere: whether pzd says that nothing is missing; a quarter of an hour
	OPENBLAS_NUM_THREADS=1 PYTHONPATH=. $(BIN)/python tests/studies/plain_study.py --jobs $(JOBS)

.PHONY: fuzz
fuzz: $(DEV)  ## Read damaged files of every format, and texts as units: only refusals may come of it; 15 minutes
	OPENBLAS_NUM_THREADS=1 PYTHONPATH=.:tests:tests/rig $(BIN)/python tests/studies/fuzz.py

.PHONY: crash-study
crash-study: $(DEV)  ## Kill a small run at 100 instants, and finish it each time: nothing may be torn; half an hour
	OPENBLAS_NUM_THREADS=1 PYTHONPATH=. $(BIN)/python tests/studies/crash_study.py --kills 100

.PHONY: sensitivity
sensitivity: $(DEV)  ## Print what the verdicts owe to each threshold, halved and doubled; half an hour
	OPENBLAS_NUM_THREADS=1 PYTHONPATH=. $(BIN)/python tests/studies/sensitivity.py

.PHONY: docs
docs: $(SITE)  ## Make a static site of the pages, the notebook and the reference: build/site/index.html
	PYTHONPATH=. $(BIN)/python docs/gather.py
	PYTHONPATH=. NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

.PHONY: notebook
notebook: $(DEV)  ## Execute docs/first_hour.ipynb anew, and keep its outputs and pictures in it
	OPENBLAS_NUM_THREADS=1 PYTHONPATH=.:tests $(BIN)/python tests/studies/notebook.py

.PHONY: format
format: $(DEV)  ## Format the code and mend what ruff can mend
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

.PHONY: lock
lock: $(DEV)  ## Resolve the dependencies again, for Python 3.11 to 3.13 and every platform
	$(LOCK) --upgrade pyproject.toml --output-file requirements.lock
	$(LOCK) --upgrade --group build --output-file requirements-build.lock
	$(LOCK) --upgrade --group dev --extra cluster --extra formats pyproject.toml --constraint requirements.lock \
	        --constraint requirements-build.lock --output-file requirements-dev.lock
	$(LOCK) --upgrade --group docs --constraint requirements-dev.lock --output-file requirements-docs.lock

.PHONY: clean
clean:  ## Remove .venv, caches and builds; results in runs/ and figures/ stay
	rm -rf .venv .pytest_cache .mypy_cache .ruff_cache .hypothesis .coverage* build dist
	find pzd tests -name __pycache__ -prune -exec rm -rf {} +

$(RUNTIME): requirements.lock requirements-build.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(None if (3, 11) <= sys.version_info[:2] <= (3, 13) else \
	    "pzd needs Python 3.11, 3.12 or 3.13, but $(PYTHON) is " + sys.version.split()[0] + "; try make PYTHON=python3.11")'
	$(PYTHON) -m venv .venv
	$(PIP) --require-hashes -r requirements.lock -r requirements-build.lock
	$(PIP) --no-deps --no-build-isolation --editable .
	@touch $@

$(DEV): $(RUNTIME) requirements-dev.lock
	$(PIP) --require-hashes -r requirements-dev.lock
	@touch $@

$(SITE): $(DEV) requirements-docs.lock
	$(PIP) --require-hashes -r requirements-docs.lock
	@touch $@
