# Two commands for a newcomer: `make demo`, `make test`. Everything lives in .venv and datasets/.
PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
DEMO ?= datasets/demo

.PHONY: demo test check study study-schedule study-crash freeze bench clean

$(READY): pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	touch $@

demo: $(READY)
	$(BIN)/musync generate demo --out $(DEMO)
	$(BIN)/musync report $(DEMO)

test: $(READY)
	$(BIN)/python -m pytest

check: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

study: $(READY)
	$(BIN)/musync sensitivity --out datasets/study

study-schedule: $(READY)
	$(BIN)/python -m benchmarks.scheduled_runs

study-crash: $(READY)
	$(BIN)/python -m benchmarks.crashes

freeze: $(READY)
	$(BIN)/musync freeze

bench: $(READY)
	$(BIN)/musync bench --out datasets/bench

clean:
	rm -rf .venv .musync build *.egg-info .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
