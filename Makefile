# Everything starts here. `make demo` and `make test` install what is missing and then do their work.

SHELL := /bin/bash
VENV := .venv
BIN := $(VENV)/bin
PYTHON3 ?= python3

.DEFAULT_GOAL := help
.PHONY: help setup demo up test chaos outages fuzz bare lint types fmt page screenshots promises bench lock sbom audit installed setup-test \
	clean

HOW_TO_CALL := The command is $(BIN)/lippmann. For this terminal, \`source $(BIN)/activate\` makes it \`lippmann\`.

help: ## Show what there is
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | awk -F ':.*## ' '{printf "  make %-8s %s\n", $$1, $$2}'
	@echo "After \`make setup\`: $(HOW_TO_CALL)"

setup: installed ## Install what is missing, and say how to call the command
	@echo "Lippmann is installed. $(HOW_TO_CALL)"
	@echo "Begin with \`lippmann up --open\` or \`lippmann docs getting-started\`."

demo: installed ## Render the paper's integral video on this machine, into out/
	$(BIN)/lippmann demo $(ARGS)

up: installed ## Start the one-machine farm; Ctrl-C ends it
	$(BIN)/lippmann up $(ARGS)

# Two files at a time. The quick tests run first, so that a plain mistake shows early.
WHOLE := tests/acceptance tests/browser tests/chaos tests/golden tests/integration tests/rules tests/security
TWO := --numprocesses 2 --dist loadfile

test: setup-test lint types ## Run all checks and all tests
ifeq ($(ARGS),)
	$(BIN)/pytest $(TWO) tests/unit povtemplates worker service lippmann
	$(BIN)/pytest $(TWO) -m "not long" $(WHOLE)
else
	$(BIN)/pytest $(ARGS)
endif

chaos: setup-test ## Try every kind of fault five times with seeds, which takes hours
	$(BIN)/python -m tests.chaos $(ARGS)

outages: setup-test ## Run the long tests of outages and upgrades, which take hours
	$(BIN)/pytest -m long $(if $(ARGS),$(ARGS),tests/browser tests/chaos tests/integration)

fuzz: setup-test ## Fuzz the readers of foreign texts, pictures and names with 100,000 inputs each, and the API with 1,500 requests a route
	$(BIN)/python -m tests.security.fuzz $(if $(ARGS),$(ARGS),--inputs 100000)
	$(BIN)/python -m tests.security.contract --examples 500

bare: ## Run the demo and the tests in an empty Debian 12 (needs root)
	deploy/bare $(ARGS)

# The modules of the dashboard run as they are; TypeScript and Prettier only check them, and their sheets of styles.
PAGE := tests/page
TOOLS := cd $(PAGE) && PATH="$(abspath $(BIN)):$$PATH"
PRETTIER := node_modules/.bin/prettier --config prettier.json --log-level warn
FORMATTED := '../../service/dashboard/static/**/*.{js,css}' '!../../service/dashboard/static/vendor/**' '*.mjs'

page: $(PAGE)/node_modules/.installed ## Check the modules of the dashboard: types, format and unit tests
	$(TOOLS) node_modules/.bin/tsc --project .
	$(TOOLS) $(PRETTIER) --check $(FORMATTED)
	$(TOOLS) node --test --test-reporter=dot

lint: installed page ## Check style and the order of imports
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports

types: installed ## Check types
	$(BIN)/mypy

fmt: installed $(PAGE)/node_modules/.installed ## Format the code
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .
	$(TOOLS) $(PRETTIER) --write $(FORMATTED)

promises: installed ## Write the tables of SECURITY.md from the markers of the tests
	$(BIN)/python -m tests.security.promises

screenshots: setup-test page ## Take pictures of every page of the dashboard in every state, into out/screenshots
	LIPPMANN_SCREENSHOTS=out/screenshots $(BIN)/pytest tests/browser/test_states.py

bench: installed ## Measure ratios against plain POV-Ray and against the limits
	$(BIN)/python -m tests.benchmarks $(ARGS)

# What the images run, and what those of workers run besides. `make lock` keeps the versions that still fit; ARGS=--upgrade takes the newest.
RUN_EXTRAS := s3 postgresql oidc telemetry
WORKER_EXTRAS := mitsuba
COMPILE := uv pip compile --universal --python-version 3.11 --generate-hashes --no-header --no-annotate --quiet

lock: ## Write the four requirements*.lock from pyproject.toml (needs uv)
	$(COMPILE) pyproject.toml --all-extras --group build $(ARGS) --output-file requirements.lock
	$(COMPILE) pyproject.toml $(RUN_EXTRAS:%=--extra %) --constraints requirements.lock \
		--output-file requirements-run.lock
	$(COMPILE) pyproject.toml $(RUN_EXTRAS:%=--extra %) $(WORKER_EXTRAS:%=--extra %) --constraints requirements.lock \
		--output-file requirements-worker.lock
	$(COMPILE) --group build --constraints requirements.lock --output-file requirements-build.lock

sbom: installed ## List the parts of the images as CycloneDX 1.6, into out/sbom.json
	@mkdir -p out
	@$(BIN)/python -W ignore::UserWarning -m cyclonedx_py requirements requirements-worker.lock --pyproject pyproject.toml \
		--spec-version 1.6 --output-reproducible --validate --output-file out/sbom.json

audit: installed ## Look up the locked packages among known vulnerabilities (needs the network)
	@deploy/audit

installed: $(VENV)/.installed
	@deploy/system-packages povray bwrap llvm

setup-test: $(VENV)/.installed
	@deploy/system-packages povray bwrap llvm chromium libatomic ffprobe examples curl

$(VENV)/.installed: requirements.lock pyproject.toml
	@deploy/system-packages venv
	$(PYTHON3) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

$(PAGE)/node_modules/.installed: $(VENV)/.installed $(PAGE)/package-lock.json
	$(TOOLS) npm ci --silent --no-audit --no-fund --ignore-scripts
	@touch $@

clean: ## Remove what was built; keeps data/ and out/
	rm -rf $(VENV) $(PAGE)/node_modules .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
