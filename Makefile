# `make serve` and `make test` work on a bare machine: Python 3.11 or newer and nothing else.
# Both are idempotent: a stamp in .venv remembers what is installed, until pyproject.toml or constraints.txt changes.

VENV   := .venv
BIN    := $(VENV)/bin
HOST   ?= 127.0.0.1
PORT   ?= 8000
# A third process on two cores takes a tenth more processor time and hardly ends sooner; with more cores, choose more.
WORKERS ?= 2
# What `make coverage` demands, in percent of lines and branches.
LIBRARY_FLOOR := 92
SERVER_FLOOR := 93
PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11 python; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && { echo $$p; break; }; done)

# Tests start hundreds of processes: without bytecode each would read all of the source again.
export PYTHONDONTWRITEBYTECODE :=

# uv takes seconds where pip takes a minute. The argument is what to install, with its extras.
define install
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check uv 2>/dev/null && \
		$(BIN)/python -m uv pip install --quiet --python $(BIN)/python -c constraints.txt -e '$(1)' || \
		{ echo "uv could not be used, so pip installs, which takes a minute"; \
		$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '$(1)'; }
endef

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help serve test test-all coverage lint format bench reproduce docs lock release clean

help:  ## Say what can be made
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-10s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

serve: $(VENV)/.serve-stamp  ## Install what is needed, serve the pages and print the link (HOST=, PORT=, DATA=)
	@$(BIN)/pftrack serve --host $(HOST) --port $(PORT) $(if $(DATA),--data-dir $(DATA))

test: lint  ## Install what the tests need, check style, types and walls, run the fast tests
	@$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal

test-all: lint  ## The same with the slow tests
	@$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal -m ""

coverage: lint  ## Run the fast tests, and hold which share of the branches they take
	@$(BIN)/coverage erase
	@$(BIN)/coverage run -m pytest -n $(WORKERS) --dist worksteal
	@$(BIN)/coverage combine --quiet
	@$(BIN)/coverage report --include 'pftrack/*' --fail-under $(LIBRARY_FLOOR)
	@$(BIN)/coverage report --include 'server/*' --fail-under $(SERVER_FLOOR)

lint: $(VENV)/.test-stamp  ## Check style, types and import walls, of the pages' scripts where Node is there
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m tools.code_lines
	@.ci/pages

format: $(VENV)/.test-stamp  ## Mend what can be mended by itself
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

bench: $(VENV)/.bench-stamp  ## Run the benchmarks against other libraries
	@$(BIN)/pftrack bench

reproduce: $(VENV)/.test-stamp  ## Compute all published results again, which takes hours, and write them into the documentation; goes on if stopped
	@$(BIN)/pftrack reproduce --full --out docs/explanation/reproduction.json \
		--revision "$$(git describe --always --dirty 2>/dev/null || echo unknown)" $(if $(CLUSTER),--cluster $(CLUSTER)) >/dev/null; \
		status=$$?; $(BIN)/python -m tools.reproduction && exit $$status

docs: $(VENV)/.docs-stamp  ## Build the documentation, with its pictures, into build/site; the server offers it under Help
	@$(BIN)/python -m tools.site

lock: $(VENV)/.test-stamp  ## Choose the newest versions of all that is installed, and write them to constraints.txt
	@$(BIN)/python -m uv pip compile --quiet --upgrade --universal --python-version 3.11 --all-extras --no-annotate \
		--no-emit-index-url --custom-compile-command "make lock" --output-file constraints.txt pyproject.toml

release: docs $(VENV)/.test-stamp  ## Build the files of a release into dist/, install each and use it as a stranger does
	@$(BIN)/python -m tools.release dist

clean:  ## Remove everything that was built, the virtual environment too
	rm -rf $(VENV) node_modules build dist docs/reference/api .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "pftrack needs Python 3.11 or newer, and none was found on the path" >&2; exit 1; }
	@echo "Creating $(VENV) with $$($(PYTHON) --version)"
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); \
		echo "Python cannot create a virtual environment; on Debian install python3-venv" >&2; exit 1; }

$(VENV)/.serve-stamp: pyproject.toml constraints.txt | $(BIN)/python
	@echo "Installing pftrack into $(VENV) (only this once)"
	$(call install,.)
	@touch $@

$(VENV)/.test-stamp: pyproject.toml constraints.txt .ci/programs | $(BIN)/python
	@echo "Installing pftrack and its test tools into $(VENV) (only this once)"
	$(call install,.[dev])
	@echo "Compiling the filters (only this once)"
	@$(BIN)/pftrack doctor --warm >/dev/null & .ci/programs && wait
	@touch $@

$(VENV)/.docs-stamp: pyproject.toml constraints.txt .ci/programs | $(BIN)/python
	@echo "Installing pftrack and what builds its documentation into $(VENV) (only this once)"
	$(call install,.[docs])
	@.ci/programs chromium
	@touch $@

# `particles` pins numpy below 2 without needing it: it is installed without its pins, and no library is downgraded.
$(VENV)/.bench-stamp: pyproject.toml constraints.txt | $(BIN)/python
	$(call install,.[bench])
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps 'particles>=0.4'
	@touch $@
