# The commands to remember: run, test, check, bench.  `make lock` renews the lock files.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV   := .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip --disable-pip-version-check --quiet
JOBS   ?= 2
SETUP  := pyproject.toml $(wildcard hatch_build.py web/package-lock.json)

.PHONY: run test test-compiled explore coverage check check-style check-imports check-page bench soak lock web fast pure vsix clean

run: $(VENV)/.run
	$(BIN)/tmcm34x ide examples/manual/5.2-first-program.tmc

# The page in Chromium is tested by itself; many of the other tests wait, so that they have one worker more.
# A test that fails has failed: nothing is tried again.
PAGES := tests/ide/page
MORE  := $(shell expr $(JOBS) + 1)
test: $(VENV)/.test
	$(BIN)/pytest -n $(MORE) --dist worksteal --ignore=$(PAGES)
	$(BIN)/pytest -n $(JOBS) --dist loadfile $(PAGES)

# The properties with new examples, ROUNDS times; `make test` always takes the same ones.
ROUNDS := 10
explore: $(VENV)/.test
	for round in $$(seq $(ROUNDS)); do $(BIN)/pytest -n $(JOBS) --dist worksteal -m hypothesis --ignore=$(PAGES) --hypothesis-profile=explore || exit; done

# Which lines and branches the tests reach, without those of the page; in .coverage-report/index.html too.
# Fails where a package reaches fewer lines than it must: all of tmcl, toolchain, firmware and chips, 90 % of the others.
COVERED := tests
coverage: $(VENV)/.test
	$(BIN)/coverage run -m pytest -q -n $(JOBS) --dist worksteal --ignore=$(PAGES) $(COVERED)
	$(BIN)/coverage combine -q
	$(BIN)/coverage html -q
	$(BIN)/coverage json -q -o - | $(BIN)/python .ci/coverage_table.py

# The tests on the compiled core, without those of pages; plain Python again afterwards, also after a failure.
ON_BOTH := tests
test-compiled: fast
	$(BIN)/pytest -n $(MORE) --dist worksteal --ignore=$(PAGES) $(ON_BOTH); status=$$?; $(BIN)/python hatch_build.py --no-core; exit $$status

# Several at a time; each is a target of its own too.
SYSTEMS := Linux Windows Darwin
CHECKS  := check-style check-imports check-page $(SYSTEMS:%=check-types-%)
check: $(VENV)/.test
	$(MAKE) --no-print-directory -j $(JOBS) $(CHECKS)

check-style: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

check-imports: $(VENV)/.test
	$(BIN)/lint-imports

check-types-%: $(VENV)/.test
	$(BIN)/pyright --pythonplatform $*

check-page: $(VENV)/.test
	$(BIN)/python hatch_build.py --check-page

# One simulated week of random commands and faults (docs/sessions.md); 1,000 killed servers; an hour of hostile hosts and
# browsers each; the properties.
soak: $(VENV)/.test
	SOAK_HOURS=168 $(BIN)/pytest -n $(JOBS) tests/test_soak.py
	SOAK_KILLS=1000 SOAK_ROUNDS=50000 $(BIN)/pytest tests/server/test_store.py tests/server/test_hostile.py
	SOAK_ROUNDS=10000 $(BIN)/pytest tests/ide/test_attacked.py
	$(MAKE) --no-print-directory explore ROUNDS=50

bench: $(VENV)/.test
	status=0; for script in benchmarks/bench_*.py; do $(BIN)/python $$script || { status=1; echo "$$script: MISSED"; }; done; exit $$status

$(VENV)/bin/python:
	$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or newer is needed" if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV)

# The package is installed in place; the build requirements come from the same lock file.
$(VENV)/.run: requirements/run.txt $(SETUP) | $(VENV)/bin/python
	$(PIP) install --require-hashes -r requirements/run.txt
	$(PIP) install --no-deps --no-build-isolation -e .
	touch $@

$(VENV)/.test: requirements/test.txt $(VENV)/.run
	$(PIP) install --require-hashes -r requirements/test.txt
	touch $@

# The page of the IDE; installing the package builds it too.
web: $(VENV)/.run
	$(BIN)/python hatch_build.py

# The core compiled in place by mypyc, and plain Python again.  Sources that change are used after the next of the two.
fast: $(VENV)/.test
	$(BIN)/python hatch_build.py --core
	$(BIN)/tmcm34x --version --verbose

pure: $(VENV)/.run
	$(BIN)/python hatch_build.py --no-core
	$(BIN)/tmcm34x --version --verbose

# The extension for VS Code, as dist/tmcl-VERSION.vsix.
vsix: $(VENV)/.run
	$(BIN)/python editors/vscode/pack.py

COMPILE := uv pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --quiet
lock:
	$(COMPILE) --group build -o requirements/run.txt
	$(COMPILE) --group build --group dev --extra can -o requirements/test.txt

clean:
	rm -rf $(VENV) .coverage .coverage.* .coverage-report build dist .pytest_cache .ruff_cache .hypothesis .benchmarks
