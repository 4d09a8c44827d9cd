# `make run` and `make test` need nothing but Python 3.10 to 3.13, make and pip.
PYTHON ?= $(shell for p in python3.11 python3.12 python3.13 python3.10 python3; do \
	$$p -c 'import sys; sys.exit(not (3,10) <= sys.version_info[:2] < (3,14))' 2>/dev/null && echo $$p && break; done)
VENV := .venv
BIN := $(VENV)/bin
OUT ?= out/adas
RUN_ARGS ?=
TEST_ARGS ?=
DRIVE_ARGS ?=
NIGHTLY_ARGS ?=

.PHONY: cockpit run published results test test-all test-times quick-share quick-mutants test-bare check wheel-check versions-check extras-check bench oracle fuzz nightly soak refs data fleet fleet-load docs figures gallery arm64 channels campaigns tables docs-run clean

# ten seeds of every distinct cell on objects, one of them once more on pixels
run: $(VENV)/.installed
	$(BIN)/skidpad adas --out $(OUT) --resume --or-next --traffic pack --sensors objects --seeds 10 --distinct \
		--parity-seeds 1 $(RUN_ARGS)
	@echo "for the commands of README.md in this shell: source $(BIN)/activate"

# the published experiment: its settings, vehicles at fixed places, images; TOWN04=FILE.xodr its map
PUBLISHED_OUT ?= out/published
published: $(VENV)/.installed
	$(BIN)/skidpad adas --out $(PUBLISHED_OUT) --resume --or-next --profile thesis_text --traffic fixed --sensors pixels \
		$(if $(TOWN04),--map $(TOWN04) --edges rail) $(RUN_ARGS)

# drives every campaign of docs/results again and says what moved; RESULTS_ARGS="matrix-figure8" drives one
results: $(VENV)/.installed
	$(BIN)/python tools/campaigns.py --again $(RESULTS_ARGS)

# the quick tests, properties with a fifth of their examples; those that were measured to take long are
# left to test-all, which is what CI runs
test: $(VENV)/.tested-with
	$(BIN)/python -m pytest -n 2 -m "not slow" --hypothesis-profile quick $(TEST_ARGS)

test-all: $(VENV)/.tested-with
	$(BIN)/python -m pytest -n 2 $(TEST_ARGS)

# all tests, and which of them are slow, for `make test`
test-times: $(VENV)/.tested-with
	$(BIN)/python -m pytest -n 2 --write-slow $(TEST_ARGS)

# lines by package and processor time of `make test` against `make test-all`; goes on where it stopped
QUICK_SHARE_ARGS ?=
quick-share: $(VENV)/.checked-with
	$(BIN)/python tools/quick_share.py $(QUICK_SHARE_ARGS)

# faults that `make test` notices of those that all tests notice; goes on where it stopped
QUICK_MUTANTS_ARGS ?=
quick-mutants: $(VENV)/.tested-with
	$(BIN)/python tools/quick_mutants.py $(QUICK_MUTANTS_ARGS)

# the tests that need a program of the system, with all such programs hidden: they skip, and say why
BARE := tests/test_programs.py tests/fleet tests/report/test_in_browser.py tests/cockpit/test_cockpit_in_browser.py \
	tests/faults/test_kills.py tests/scenarios/test_run_export.py tests/scenarios/test_hazard_export.py \
	tests/scenarios/test_shipped_scenarios.py
test-bare: $(VENV)/.tested-with
	env -u SKIDPAD_ASAM_PYTHON -u SKIDPAD_MUST_RUN SKIDPAD_ONLY_PATH=1 PATH=$(CURDIR)/$(BIN) \
		$(CURDIR)/$(BIN)/python -m pytest --program-tests -p no:cacheprovider $(BARE)

check: $(VENV)/.checked-with
	$(BIN)/ruff format --check src tests tools
	$(BIN)/ruff check src tests tools
	$(BIN)/mypy
	$(BIN)/python tools/kernel_lint.py
	$(BIN)/python tools/language_lint.py
	$(BIN)/lint-imports

wheel-check: $(BIN)/python
	PYTHON=$(BIN)/python .ci/wheel

# the newest versions that are allowed on the newest Python here, the oldest on the oldest
versions-check: $(BIN)/python
	$(BIN)/python tools/versions_check.py

# which extras install from wheels on which Python; asks the package index, needs uv
extras-check: $(BIN)/python
	$(BIN)/python tools/extras_check.py

# damaged files for every reader, a process per core; what CI tries are the first 500
# one thread for tables: the cores are busy, and small tables pay more for threads than they gain
FUZZ ?= 100000
fuzz: $(VENV)/.tested-with
	POLARS_MAX_THREADS=1 $(BIN)/python -m pytest -n auto --dist worksteal tests/faults/test_readers.py --fuzz $(FUZZ) --durations=0

# proofs too long for every change, each with a dated line; NIGHTLY_ARGS="--only fuzz" drives one
nightly: $(VENV)/.tested-with
	$(BIN)/python tools/nightly.py $(NIGHTLY_ARGS)

# the CARLA server and a worker for hours; goes on where it was stopped
soak: $(VENV)/.tested-with
	$(BIN)/python tools/nightly.py --only soak-server soak-worker $(NIGHTLY_ARGS)

# files of others against the stored trajectories of esmini: make oracle CORPUS=DIR
CORPUS ?= corpus
oracle: $(VENV)/.tested-with
	$(BIN)/python tools/scenario_oracle.py compare $(CORPUS)

bench: $(VENV)/.installed
	$(BIN)/skidpad bench

# drive in a browser: prints an address
cockpit: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --prefer-binary -e '.[cockpit]'
	$(BIN)/skidpad drive $(DRIVE_ARGS)

refs: $(VENV)/.tested-with
	$(BIN)/python -m pytest tests/references -s --rewrite-references

# what tools/ writes is committed; tests compare it byte for byte
data: $(VENV)/.tested-with
	PYTHONPATH=tools $(BIN)/python -m mapmaker
	$(BIN)/python tools/scenario_catalogue.py

# vehicles drive, report, get a good and a bad update; ends with the dashboard's address
fleet: $(VENV)/.tested-with
	$(BIN)/skidpad fleet demo --out out/fleet

fleet-load: $(VENV)/.tested-with
	$(BIN)/python tools/fleet_load.py --records 20000
	$(BIN)/python tools/fleet_load.py --records 20000 --kills 20

# the evaluation of the channels, whole, and the tables of its page: about 3 h on two
# processors; goes on where it stopped. ONLY=hazards, redundancy or rules: one of its three parts; WORKERS=16: processes
HOURS ?= 50
channels: $(VENV)/.tested-with
	PYTHONPATH=src $(BIN)/python tools/channels_campaign.py --out out/channels --hours $(HOURS) --publish \
		$(if $(ONLY),--only $(ONLY)) $(if $(WORKERS),--workers $(WORKERS))

# whether the channels monitor's kernels compile for ARM64
arm64: $(VENV)/.tested-with
	PYTHONPATH=src $(BIN)/python tools/arm64_check.py

# docs/results/preregistration.yaml says what is driven; goes on where it was left
campaigns: $(VENV)/.installed
	$(BIN)/python tools/campaigns.py $(CAMPAIGN_ARGS)

# tables of docs/ from the results that campaigns left in docs/results
tables: $(VENV)/.installed
	$(BIN)/python tools/result_tables.py
	$(BIN)/python tools/benchmarks_page.py

# the documentation as a site in build/site
docs: $(VENV)/.documented-with
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet
	@echo "the site is at build/site/index.html"

# every block of README and docs/ in full, before a release; the times are kept in docs/results/docs-run.csv
docs-run: $(VENV)/.tested-with
	$(BIN)/python tools/docs_run.py

# figures of docs/physics.md, bodies of vehicles and the README's pictures; REPORT=out/adas: its first page too
REPORT ?=
figures: $(VENV)/.tested-with
	$(BIN)/python tools/vehicle_validation.py docs/img
	$(BIN)/python tools/readme_pictures.py docs/img $(REPORT)
	$(BIN)/python tools/body_pictures.py docs/img/bodies

# replays of the site's gallery, by their commands; GALLERY="guardrail": one of docs/gallery.yaml
GALLERY ?=
gallery: $(VENV)/.tested-with
	$(BIN)/python tools/gallery.py $(GALLERY)

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "skidpad needs Python 3.10 to 3.13 on the PATH"; exit 2; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip

$(VENV)/.installed: $(BIN)/python pyproject.toml
	$(BIN)/python -m pip install --quiet --prefer-binary -e .
	touch $@

$(VENV)/.tested-with: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --prefer-binary -e '.[test,server,cluster,ros,live,learn,search,cockpit,fleet,osi,crg,geo,rl]'
	-$(BIN)/python -m pip install --quiet --prefer-binary -e '.[carla]'
	touch $@

$(VENV)/.checked-with: $(VENV)/.tested-with
	$(BIN)/python -m pip install --quiet --prefer-binary -e '.[check]'
	touch $@

$(VENV)/.documented-with: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --prefer-binary -e '.[docs]'
	touch $@

clean:
	rm -rf $(VENV) out build dist
