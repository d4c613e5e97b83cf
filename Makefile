# Two commands for a fresh machine with Python >= 3.11: `make demo` and `make test`.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

# One BLAS thread: two on a busy machine cost more than they give.
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1
export MKL_NUM_THREADS := 1

# Some hundred processes that tests start would each compile every module, and tests would be rewritten at every run.
unexport PYTHONDONTWRITEBYTECODE

# Hours of `make soak`.
HOURS ?= 0.05

.PHONY: help install install-base install-test demo test bench soak docs lint clean

help:
	@echo "make demo     run the whole job on simulated instruments; results in demo/"
	@echo "make test     run every test"
	@echo "make install  make $(VENV) with the command jointlab"
	@echo "make install-base  the same without page, reports, PostgreSQL and cluster: for the computer of a rig"
	@echo "make bench    measure accuracy and speed; figures worth keeping are in docs/"
	@echo "make soak     campaigns, faults and clients for HOURS (0.05), and what grows: make soak HOURS=8"
	@echo "make docs     build the documentation site; open site/index.html"
	@echo "make lint     ruff and mypy"
	@echo "make clean    remove $(VENV), demo/ and caches"

install: $(VENV)/.installed

install-base: requirements-base.lock $(VENV)/.installed-pip
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements-base.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --editable .

install-test: $(VENV)/.installed-test

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "Jointlab needs Python 3.11 or newer; run make PYTHON=/path/to/python3.11"; exit 1; }
	$(PYTHON) -m venv $(VENV)

# Python brings an old pip, and with some versions an old setuptools, which nothing here uses.
$(VENV)/.installed-pip: requirements-pip.lock | $(VENV)/bin/python
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements-pip.lock
	$(BIN)/pip uninstall --quiet --yes setuptools 2>/dev/null || true
	@touch $@

$(VENV)/.installed: requirements.lock pyproject.toml $(VENV)/.installed-pip
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --editable .
	@touch $@

$(VENV)/.installed-test: requirements-test.lock $(VENV)/.installed
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements-test.lock
	@touch $@

$(VENV)/.installed-docs: requirements-docs.lock $(VENV)/.installed
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements-docs.lock
	@touch $@

demo: install
	$(BIN)/jointlab demo

test: install-test
	@sh tests/install_programs.sh $(VENV)
	$(BIN)/pytest -n 2 --dist worksteal  # a third would starve watchdogs of simulated testers on two slow cores

bench: install-test
	$(BIN)/python -m tests.bench

soak: install-test
	HOURS=$(HOURS) $(BIN)/python -m tests.bench bench_soak

docs: $(VENV)/.installed-docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

lint: install-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

clean:
	rm -rf $(VENV) .venv-peers demo build site *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
