# make demo   set up .venv and decide paper/4a        make bench  the table of speeds
# make test   set up .venv and run every check        make clean  remove what was made
# make lint   style and types alone                   make distclean   the same, and .venv
# make versions LIST=oldest   the paper's cases and some tests with the versions of tools/versions/oldest.txt, or newest.txt
# make docs   the pages as a site, in out/docs
# make campaign NAME=oracle   the same tests with all that takes too long for make test; all without NAME
# make bench BENCH=old.json   the same, with figures in that file and not in out/bench.json
# make bench-compare OLD=old.json NEW=new.json   two such files side by side
# make mutants ONLY=stretches   small faults put into the code: which of them no test finds; all without ONLY
# make test-browser   the live page, by mouse and keyboard, in a Chromium
# PYTHON=/path/to/python chooses the interpreter (CPython 3.11 or later).

BIN := .venv/bin
CANDIDATES := python3.11 python3 python3.12 python3.13 python3.14 python
IS_RECENT := import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))

# Many tests start processes, which should not compile our modules each time anew.
unexport PYTHONDONTWRITEBYTECODE

.DELETE_ON_ERROR:
.PHONY: help demo docs test test-browser versions lint kernels greedy collected bench bench-compare campaign mutants clean distclean

help:
	@sed -n '/^#/!q; s/^# //p' Makefile

# The stamp is younger than pyproject.toml once everything it names is installed. Python compiles what it
# imports, which is a third of what pip would compile. The pip of Python 3.11 takes half as long again to choose versions.
PIP_INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-input --no-compile
.venv/installed: pyproject.toml
	@if ! $(BIN)/python -m pip --version >/dev/null 2>&1; then \
	    for candidate in $(or $(PYTHON),$(CANDIDATES)); do \
	        if "$$candidate" -c '$(IS_RECENT)' 2>/dev/null; then python="$$candidate"; break; fi; \
	    done; \
	    if [ -z "$$python" ]; then \
	        echo "needs CPython 3.11 or later with venv; say where: make PYTHON=/path/to/python" >&2; \
	        exit 2; \
	    fi; \
	    echo "making .venv with $$("$$python" --version)"; \
	    "$$python" -m venv --clear .venv; \
	fi
	@echo "installing coverable and its libraries into .venv (a minute or two) ..."
	@$(PIP_INSTALL) --upgrade 'pip>=25' 'setuptools>=77'
	@$(PIP_INSTALL) --no-build-isolation -e '.[dev]'
	@touch $@

demo: .venv/installed
	@mkdir -p out
	@$(BIN)/coverable check paper/4a --html out/paper-4a.html
	@echo "Open it in a browser: file://$(CURDIR)/out/paper-4a.html"

lint: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/pyrefly check --progress-bar=no --threads=1

# Compiles kernels into the cache, once what several of them are made of: the complete search, proofs and
# collisions, and by itself the paper's search.
CHECK := import sys; from coverable import check, load_case; \
    [check(*load_case(name, settings).build()) for name, *settings in map(str.split, sys.argv[1:])]
kernels: .venv/installed
	@$(BIN)/python -c '$(CHECK)' paper/4a paper/4d 'paper/5e collision.clearance=0.005'

greedy: .venv/installed
	@$(BIN)/python -c '$(CHECK)' 'paper/4f search.method=greedy' tests/paper/greedy_on_a_torus.toml

# What the tests import is compiled once, and not by each of the two processes that run them; they
# say it where that fails.
collected: .venv/installed
	@$(BIN)/python -m pytest --collect-only --quiet tests >/dev/null || true

# Two processes share the processors: threads that wait for the next small matrix only take them from each other.
test: export OPENBLAS_NUM_THREADS := 1
test: .venv/installed
	@$(MAKE) --no-print-directory --jobs=2 kernels lint greedy collected
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

docs: .venv/installed
	@$(BIN)/python -c 'import sphinx, furo, myst_parser' 2>/dev/null || $(PIP_INSTALL) --no-build-isolation -e '.[docs]'
	$(BIN)/python docs/figures.py
	$(BIN)/sphinx-build --quiet --fail-on-warning --keep-going -b html docs out/docs

# A fresh environment of its own, with kernels of its own; the twelve cases are among the tests. Old libraries may warn of
# new ones that they use.
LIST := oldest
versions: ENV := out/versions-$(LIST)
versions:
	rm -rf $(ENV)
	$(or $(PYTHON),python3) -m venv $(ENV)
	$(ENV)/bin/python -m pip install --quiet -e . -c tools/versions/$(LIST).txt pytest hypothesis python-fcl
	NUMBA_CACHE_DIR=$(CURDIR)/$(ENV) $(ENV)/bin/python -m pytest -q -W default::DeprecationWarning \
	    tests/test_docs.py::test_complete_columns_of_the_table tests/paper tests/robots/test_kinematics.py \
	    tests/surfaces/test_mesh_readers.py tests/surfaces/test_surface_contract.py tests/input/test_cases.py \
	    tests/input/test_results.py tests/output/test_pages.py tests/verdicts/test_checking.py

# Installs nothing: it needs the extra `browser`, and a Chromium on the path or named by CHROMIUM.
test-browser:
	$(BIN)/python -m pytest -rP tests/browser

campaign: .venv/installed
	$(BIN)/python -m pytest -n 2 --dist loadfile -rP -m sampled --samples=all -k "$(NAME)" tests

mutants: .venv/installed
	$(BIN)/python tests/mutants/mutants.py "$(ONLY)"

# Processor times, in a table and as JSON with counts beside them; BENCH_ARGS="-k greedy" runs those alone.
BENCH := out/bench.json
bench: .venv/installed
	@mkdir -p $(dir $(BENCH))
	$(BIN)/python -m pytest tests/benchmarks -p pytest_benchmark.plugin -q \
	    -o python_files='bench_*.py' -o python_functions='bench_*' --benchmark-timer=time.process_time \
	    --benchmark-columns=min,median,rounds --benchmark-sort=fullname --benchmark-json=$(BENCH) $(BENCH_ARGS)

# make takes words for targets, so the two files are variables; NEW is what make bench wrote last.
bench-compare: NEW := $(BENCH)
bench-compare: .venv/installed
	@$(BIN)/pytest-benchmark compare "$(OLD)" "$(NEW)" --group-by=fullname --columns=min --sort=fullname

clean:
	rm -rf out build dist *.egg-info .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +

distclean: clean
	rm -rf .venv
