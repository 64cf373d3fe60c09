# Everything here needs GNU make and Python 3.11 or newer; the rest is installed into .venv.
#
#   make demo    reproduce the paper and write its report
#   make test    every check and every test
#   make help    the other targets
#
# To choose the interpreter: make PYTHON=/path/to/python3.12 test

VENV := .venv
BIN := $(VENV)/bin
# Written when an installation is complete; older than pyproject.toml means out of date.
RUN_STAMP := $(VENV)/.installed-run
DEV_STAMP := $(VENV)/.installed-dev
REPRODUCTION := build/reproduction
# What the tests of copsense.torch run with. With CUDA, as pip has it on Linux, gigabytes.
TORCH ?= torch==2.13.0
# What the tests of a module share is made in one process; conftest.py puts long modules first.
PYTEST_ARGS ?= -n auto --maxprocesses 8 --dist loadscope --no-loadscope-reorder

# The matrices are small: one BLAS thread per process is fastest, and tests run in parallel.
export OPENBLAS_NUM_THREADS ?= 1
export OMP_NUM_THREADS ?= 1
export MKL_NUM_THREADS ?= 1
# Packages from elsewhere (a sourced ROS set-up, say) must not shadow those of .venv.
unexport PYTHONPATH
unexport PYTHONHOME
# Modules compiled once are kept: the tests' import of copsense takes four times as long without.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

.PHONY: help
help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

.PHONY: demo
demo: $(RUN_STAMP) ## reproduce the paper; print where the report is
	@mkdir -p $(dir $(REPRODUCTION))
	@$(BIN)/copsense reproduce --output $(REPRODUCTION) --force

.PHONY: test
test: checks ## every check, then every test
	$(BIN)/pytest $(PYTEST_ARGS)

.PHONY: checks
checks: $(DEV_STAMP) ## lint, format, types and imports, two at a time
	@$(MAKE) --no-print-directory -j2 $(if $(filter output-sync,$(.FEATURES)),--output-sync) \
	    lint format types imports

.PHONY: pytest
pytest: $(DEV_STAMP) ## the tests alone
	$(BIN)/pytest $(PYTEST_ARGS)

.PHONY: lint
lint: $(DEV_STAMP) ## mistakes, style and spelling
	$(BIN)/ruff check
	$(BIN)/typos

.PHONY: format
format: $(DEV_STAMP) ## formatting (checked, nothing is changed)
	$(BIN)/ruff format --check

.PHONY: types
types: $(DEV_STAMP) ## type hints, and that every public name has one
	$(BIN)/mypy
	@# It looks for the packages of the first python on PATH, and lists every module.
	@report=$$(PATH="$(abspath $(BIN)):$$PATH" $(BIN)/basedpyright --verifytypes copsense \
	    --ignoreexternal) || { echo "$$report"; exit 1; }; \
	echo "$$report" | grep 'completeness score'

.PHONY: imports
imports: $(DEV_STAMP) ## which module may import which
	$(BIN)/lint-imports

.PHONY: fix
fix: $(DEV_STAMP) ## format, and fix what can be fixed without thought
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

.PHONY: docs
docs: $(DEV_STAMP) ## build the documentation into build/docs; a warning is an error
	$(BIN)/sphinx-build --quiet --fail-on-warning --keep-going --nitpicky \
	    --doctree-dir build/doctrees --builder html docs build/docs
	$(BIN)/pytest -n 0 -q tests/built_docs
	@echo "build/docs/index.html"

.PHONY: package
package: $(DEV_STAMP) ## build sdist and wheel into dist; try them and the repository as a release
	@$(BIN)/python -m pip install --quiet --quiet --disable-pip-version-check --group release
	$(BIN)/repo-review .
	$(BIN)/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.dependabot .github/dependabot.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff
	$(BIN)/zizmor --offline --quiet .github
	$(BIN)/python tools/try_wheel.py

BASE ?= HEAD~1
.PHONY: history
history: $(DEV_STAMP) ## what a posture costs here and at the commit BASE, as ratios
	@$(BIN)/python -m pip install --quiet --quiet --disable-pip-version-check --group history
	$(BIN)/python benchmarks/history.py $(BASE)

.PHONY: venv
venv: $(DEV_STAMP) ## set .venv up for development

.PHONY: torch
torch: $(DEV_STAMP) ## PyTorch into .venv, which the tests of copsense.torch need
	@$(BIN)/python -c 'import torch' 2>/dev/null || $(BIN)/python -m pip install --quiet --quiet \
	    --disable-pip-version-check --group learning '$(TORCH)'

.PHONY: clean
clean: ## remove everything that was built, .venv included
	rm -rf $(VENV) build dist docs/api docs/gallery
	rm -rf .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find docs examples src tests -name __pycache__ -type d -prune -exec rm -rf {} +

# --- set-up -------------------------------------------------------------------------------------

PIP_INSTALL = $(BIN)/python -m pip install --quiet --quiet --disable-pip-version-check --editable

$(RUN_STAMP): pyproject.toml
	@$(MAKE) --no-print-directory ensure-venv
	@echo "Installing copsense and the robot models into $(VENV) ..."
	@$(PIP_INSTALL) '.[explore,fast,report,sim]'
	@touch $@

$(DEV_STAMP): pyproject.toml
	@$(MAKE) --no-print-directory ensure-venv
	@echo "Installing copsense with its development tools into $(VENV) ..."
	@# The pip of an older Python knows no dependency groups.
	@$(BIN)/python -m pip install --quiet --quiet --disable-pip-version-check 'pip>=25.1'
	@$(PIP_INSTALL) '.[all]' --group dev
	@touch $(RUN_STAMP) $@

# Keeps an environment that works. Otherwise makes one with the first interpreter that can;
# each is run to find out, since a name on PATH may be a shim that only fails.
.PHONY: ensure-venv
ensure-venv:
	@if $(BIN)/python -c 'import sys, pip; sys.exit(sys.version_info < (3, 11))' \
	        >/dev/null 2>&1; then \
	    exit 0; \
	fi; \
	bare=; \
	for python in $(or $(PYTHON),python3.13 python3.12 python3.11 python3 python); do \
	    "$$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	        >/dev/null 2>&1 || continue; \
	    if "$$python" -c 'import ensurepip, venv' >/dev/null 2>&1; then \
	        echo "Making $(VENV) with $$("$$python" --version) ($$python) ..."; \
	        exec "$$python" -m venv --clear $(VENV); \
	    fi; \
	    bare=$${bare:-$$python}; \
	done; \
	exec >&2; \
	if [ -n "$$bare" ]; then \
	    version=$$("$$bare" -c 'import sys; print("%d.%d" % sys.version_info[:2])'); \
	    echo "copsense: $$bare (Python $$version) lacks the modules venv and ensurepip."; \
	    echo "On Debian or Ubuntu: apt install python$$version-venv"; \
	else \
	    echo "copsense: no Python 3.11 or newer that runs was found. Tried:" \
	        "$(or $(PYTHON),python3.13 python3.12 python3.11 python3 python)."; \
	    echo "Install one (Debian 12, Ubuntu 24.04: apt install python3 python3-venv)," \
	        "or name it: make PYTHON=/path/to/python3"; \
	fi; \
	exit 1
