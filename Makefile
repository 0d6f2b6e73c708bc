# Two commands for a newcomer: `make demo`, `make test`. Everything lives in .venv and datasets/.
PYTHON ?= python3
BIN := .venv/bin
PIP := $(BIN)/python -m pip --quiet --disable-pip-version-check
HASHED := --no-deps --require-hashes --requirement
READY := .venv/.ready
DEMO ?= datasets/demo
WORKERS ?= 2

.PHONY: demo test test-minutes check docs docs-serve study study-schedule study-crash study-fuzz study-faults study-double-track study-drives study-scale study-production study-mutants study-exports study-calibration study-editors study-learning study-streets freeze bench lock size clean

# Whatever comes from the network is held against a hash of constraints.txt, but for torch: one version of it has builds
# with and without CUDA, one an index, and which of them is at hand differs; what a CUDA build needs beyond is not in the
# list either. The last line installs these two, and muSync itself, with the setuptools of the list. A package without a
# wheel for this platform is built from its source (whose hash is checked) with build tools that pip fetches unchecked.
# uv takes a sixth of the time of pip. If it fails, as where only pip's settings name an index, pip follows. Python compiles
# what it imports when it first does, and keeps that, whatever the shell says: to compile every file of every library
# here takes 40 s.
export PYTHONDONTWRITEBYTECODE :=
$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv .venv
	sed -n '/^uv==/,/[^\\]$$/p' constraints.txt | $(PIP) install --no-compile $(HASHED) /dev/stdin
	$(BIN)/uv pip install --quiet --python $(BIN)/python $(HASHED) constraints.txt || \
		$(PIP) install --no-compile $(HASHED) constraints.txt
	$(PIP) install --no-compile --no-build-isolation --editable '.[dev]'
	touch $@

# The newest versions that pyproject.toml allows: make lock LOCK=--upgrade
lock: $(READY)
	$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-package torch \
		--extra dev --custom-compile-command 'make lock' --output-file constraints.txt $(LOCK) pyproject.toml

demo: $(READY)
	$(BIN)/musync generate demo --out $(DEMO)
	$(BIN)/musync report $(DEMO)

# A file's tests go to one worker, which makes what they share once; in the order of the tree, as the last files are
# quick ones. No other plugin is loaded than xdist.
test: export PYTEST_DISABLE_PLUGIN_AUTOLOAD := 1
test: $(READY)
	$(BIN)/python -m pytest -p xdist --numprocesses $(WORKERS) --dist loadfile --no-loadscope-reorder

# Tests that take minutes, which `make test` leaves out.
test-minutes: $(READY)
	$(BIN)/python -m pytest -m minutes

# How large the project is: code, tests, words of the documents and their long sentences.
size: $(READY)
	$(BIN)/python -m benchmarks.size

check: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The documentation as a site, in build/docs, which needs no server; docs-serve shows it at 127.0.0.1:8000 while you write.
docs docs-serve: export NO_MKDOCS_2_WARNING := 1
docs docs-serve: $(READY)
	$(PIP) install --no-build-isolation --editable '.[docs]'
	$(BIN)/python -m mkdocs $(if $(filter docs,$@),build --strict,serve)

study: $(READY)
	$(BIN)/musync lab sensitivity --out datasets/study

study-schedule: $(READY)
	$(BIN)/python -m studies.scheduled_runs

study-crash: $(READY)
	$(BIN)/python -m studies.crashes

study-fuzz: $(READY)
	$(BIN)/python -m studies.fuzzing

study-faults: $(READY)
	$(BIN)/python -m studies.store_faults

study-double-track: $(READY)
	$(BIN)/python -m studies.double_track --make datasets/double-track
	$(BIN)/python -m studies.double_track --judge datasets/double-track

# The paper's brake-dive protocol (Appendix C.5) on made-up drives.
study-drives: $(READY)
	$(BIN)/musync lab synthetic-drives --out datasets/drives
	$(BIN)/musync import-measurements datasets/drives --map a2d2 --out datasets/a2d2
	$(BIN)/musync lab brake-protocol datasets/a2d2 --out datasets/brake-protocol

# How memory and time grow with the clips; SCALE="100000 --folder /dev/shm" takes some 4 CPU-minutes.
study-scale: $(READY)
	$(BIN)/python -m studies.scale $(SCALE)

study-production: $(READY)
	$(BIN)/python -m studies.production

study-mutants: $(READY)
	$(BIN)/python -m studies.mutants

# The readers of the exported formats, in an environment of their own; nuscenes-devkit asks for old versions of libraries
# that it runs without.
EXPORTS := .venv-exports/bin/python -m
study-exports:
	$(PYTHON) -m venv .venv-exports
	$(EXPORTS) pip install --quiet --editable '.[dev,export]' webdataset pykitti plyfile pycocotools evo mlcroissant prov \
		libcosimpy ecospy
	$(EXPORTS) pip install --quiet --no-deps nuscenes-devkit pyquaternion descartes shapely scikit-learn joblib \
		threadpoolctl tqdm cachetools parameterized
	$(EXPORTS) pytest -rs tests/flows/exporting
study-calibration: $(READY)
	$(BIN)/python -m studies.known_truth

study-editors: $(READY)
	$(BIN)/python -m studies.video_sets.editors datasets/editors

# A small network learns friction from pictures (docs/tutorial/learn-friction.md): ten minutes, most of them for the dataset.
study-learning: $(READY)
	$(BIN)/python -m studies.learn_friction

# 204 streets of six kinds: half an hour of one processor
study-streets: $(READY)
	$(BIN)/musync scene gallery --streets 4 --out datasets/streets/gallery
	$(BIN)/musync scene check --streets 34 --out datasets/streets/check

freeze: $(READY)
	$(BIN)/musync lab freeze

bench: $(READY)
	$(BIN)/musync lab bench --out datasets/bench

clean:
	rm -rf .venv .musync build *.egg-info .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
