# `make demo` and `make test` need only Python 3.11+, make and a network; they create the environment themselves.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
DEMO_READY := $(VENV)/.demo-ready
READY := $(VENV)/.ready
BENCH_READY := $(VENV)/.bench-ready
FUZZ_READY := $(VENV)/.fuzz-ready
WEB_READY := $(VENV)/.web-ready
ROS2 := build/ros2
ROS2_READY := $(ROS2)/.ready
NPM := build/npm
NPM_READY := $(NPM)/.ready

.PHONY: demo test coverage measured unmeasured quick bytecode nightly flakes web-bench web-test web-types web-unit check lint types pyright mypy contracts format bench soak slot-kills mesh-soak mesh-crowd soak-ros2 fuzz hostile upstream rclpy-tests ros2cli-bridge judges clean
.DEFAULT_GOAL := check

$(DEMO_READY): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "callboard needs Python 3.11 or later: make PYTHON=python3.11")'
	@echo "Setting up $(VENV) (once) ..."
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv --clear $(VENV) || \
		{ echo "Cannot create $(VENV): $(PYTHON) needs its venv module (Debian: apt install python3-venv)"; exit 1; }
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

# Ten times as much, which the demo need not wait for.
EXTRAS ?= dev

$(READY): $(DEMO_READY)
	@echo "Installing the tools of tests and checks (once) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[$(EXTRAS)]'
	@touch $@

demo: $(DEMO_READY)
	@$(BIN)/callboard demo

# Real ROS 2 and callboard, for tests/real_ros; an environment of its own, as the ROS face refuses to work beside a real
# rclpy. Where there are no wheels of ROS 2 it stays empty, and the tests are deselected.
$(ROS2_READY): pyproject.toml | $(READY)
	@mkdir -p $(ROS2)
	@if $(BIN)/python -m tests.real_ros; then \
		echo "Setting up $(ROS2) (once) ..." && \
		{ $(ROS2)/bin/python -m pip --version >/dev/null 2>&1 || $(BIN)/python -m venv --clear $(ROS2); } && \
		$(ROS2)/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[ros2]'; fi
	@touch $@

WORKERS ?= auto
TEST := $(BIN)/python -m pytest --numprocesses=$(WORKERS) --dist=worksteal

# COVERAGE=1 measures the coverage of these tests, which run the code in their own process; the others run without it, in
# workers of their own (tests/measurement.py).
# The others mostly wait for processes: with no more workers they end long after the measured ones.
UNMEASURED_WORKERS ?= $(WORKERS)
MEASURED := $(addprefix tests/,proto broker actors hostile)

ifdef COVERAGE
test: measured unmeasured
else
test: $(READY) $(ROS2_READY)
	@$(TEST) $(PYTEST_FLAGS)
endif

measured: $(READY)
	@MEASURE_COVERAGE=1 $(TEST) $(MEASURED) $(PYTEST_FLAGS)

unmeasured: $(READY) $(ROS2_READY)
	@$(TEST) --numprocesses=$(UNMEASURED_WORKERS) $(addprefix --ignore=,$(MEASURED)) $(PYTEST_FLAGS)

coverage: $(READY)
	@$(MAKE) --no-print-directory test COVERAGE=1

# Without the tests that start processes or simulate histories.
quick: $(READY)
	@$(TEST) $(addprefix --ignore=tests/,integration hostile real_ros ros2 simulation) -m 'not processes' $(PYTEST_FLAGS)

# Import all that tests import, once: on a clean checkout, workers that begin together would each compile it.
bytecode: $(READY)
	@log=$$($(BIN)/python -m pytest --collect-only 2>&1) || { echo "$$log"; exit 1; }

nightly: $(READY) $(ROS2_READY)
	@$(TEST) --nightly --timeout=3600 $(PYTEST_FLAGS)
	@$(BIN)/python -m tests.simulation.killing_seeds
	@$(MAKE) --no-print-directory web-test judges

# Run the tests RUNS times beside LOAD busy processes, and list which failed how often. Output: build/flakes.
RUNS ?= 20
LOAD ?= 0

flakes: $(READY) $(ROS2_READY)
	@$(BIN)/python -m tests.flakes --runs $(RUNS) --load $(LOAD) -- $(TEST) $(PYTEST_FLAGS)

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: pyright mypy

pyright mypy: $(READY)
	$(BIN)/$@

contracts: $(READY)
	$(BIN)/lint-imports

check: $(READY)
	@$(MAKE) --no-print-directory --jobs=4 --output-sync lint types contracts
	@$(MAKE) --no-print-directory test
	@$(MAKE) --no-print-directory soak-ros2 ROS2_MINUTES=0.5 FIRST=7

# Programs written for ROS 2, in checkouts of https://github.com/ros2/examples and demos below the folder UPSTREAM.
upstream: $(READY)
	@$(BIN)/python -m tests.upstream "$(or $(UPSTREAM),$(error make upstream UPSTREAM=folder with checkouts))" $(UPSTREAM_FLAGS)
	@$(BIN)/python -m tests.upstream.suites $(UPSTREAM)

# rclpy's own tests with callboard in its place, from a checkout with its history in the folder UPSTREAM.
rclpy-tests: $(READY) $(ROS2_READY)
	@$(BIN)/python -m tests.upstream.rclpy_tests "$(or $(UPSTREAM),$(error make rclpy-tests UPSTREAM=folder with a checkout of rclpy))" $(UPSTREAM_FLAGS)

# The real command `ros2` and a node of callboard, with a bridge between them; from checkouts of ros2cli and rosidl_runtime_py.
ros2cli-bridge: $(READY) $(ROS2_READY)
	@$(BIN)/python -m tests.upstream.bridged_ros2cli "$(or $(UPSTREAM),$(error make ros2cli-bridge UPSTREAM=folder with checkouts of ros2cli and rosidl_runtime_py))"

# Tests of packages from the package index that are written for rclpy, and clients of rosbridge.
judges: $(READY) $(NPM_READY)
	@$(BIN)/python -m tests.upstream.distributions
	@$(BIN)/python -m tests.upstream.rosbridge_clients

format: $(READY)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# The peers' servers are not wheels: apt install nats-server redis-server mosquitto. Missing ones are skipped.
$(BENCH_READY): $(READY)
	@echo "Adding the peers to $(VENV) (once) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev,bench]'
	@touch $@

bench: $(BENCH_READY)
	@$(BIN)/python benchmarks/suite.py

# Simulate histories with faults for SOAK_MINUTES; FIRST and SEEDS select seeds. A violation prints how to reproduce it.
SOAK_MINUTES ?= 5
FIRST ?= 0

soak: $(READY)
	@$(BIN)/python -m tests.simulation.soak --minutes $(SOAK_MINUTES) --first-seed $(FIRST) $(if $(SEEDS),--seeds $(SEEDS)) $(if $(MESH),--mesh)

# Kill a publisher, a reader or a broker at each step of a slot's life in shared memory, ROUNDS times in all.
ROUNDS ?= 1000

slot-kills: $(READY)
	@$(BIN)/python -m tests.integration.slot_kills --rounds $(ROUNDS) --seed $(FIRST)

# Brokers in a mesh, as processes: churn for SOAK_MINUTES; how long 8 x 50 nodes take to see each other.
mesh-soak: $(READY)
	@$(BIN)/python -m tests.integration.mesh.soak --minutes $(SOAK_MINUTES)

mesh-crowd: $(READY)
	@$(BIN)/python -m tests.integration.mesh.crowd

# Nodes of callboard and of ROS 2 come and go on both sides of a bridge, which is killed, too. FIRST is the seed.
ROS2_MINUTES ?= 10

soak-ros2: $(READY) $(ROS2_READY)
	@$(BIN)/python -m tests.ros2.soak --minutes $(ROS2_MINUTES) --seed $(FIRST)

# Fuzz each target for FUZZ_SECONDS. An input that fails is kept in build/fuzz, and printed.
FUZZ_SECONDS ?= 450
FUZZ_TARGETS ?= codec session router rules mesh launch parameters web

$(FUZZ_READY): $(READY)
	@echo "Adding atheris to $(VENV) (once) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev,fuzz]'
	@touch $@

fuzz: $(FUZZ_READY)
	@for target in $(FUZZ_TARGETS); do \
		$(BIN)/python -m tests.fuzz $$target -max_total_time=$(FUZZ_SECONDS) -max_len=4096 || exit 1; done

# Attack brokers, pages and nodes with floods of full size, and measure innocent ones next to them; ATTACKS selects some;
# PEERS=1 attacks nats-server and mosquitto, too, where it fits.
hostile: $(READY)
	@$(BIN)/python -m tests.hostile.attack --json build/hostile.json $(if $(PEERS),--peers) $(ATTACKS)

# The page in Chromium, and the types of its scripts. Needs npm; on Debian it installs Chromium if that is missing.
$(NPM_READY): tests/browser/package.json
	@command -v npm >/dev/null || { echo "make web-test needs npm (Debian: apt install npm)"; exit 1; }
	@echo "Adding npm packages to $(NPM) (once) ..."
	@mkdir -p $(NPM) && cp tests/browser/package.json $(NPM)/ && npm install --silent --no-audit --no-fund --prefix $(NPM)
	@touch $@

$(WEB_READY): $(READY) $(NPM_READY)
	@command -v chromium >/dev/null || command -v chromium-browser >/dev/null || { \
		echo "Installing Chromium ..." && apt-get update -qq && apt-get install -y -qq --no-install-recommends chromium \
		>/dev/null; } || { echo "make web-test needs Chromium (Debian: apt install chromium)"; exit 1; }
	@$(BIN)/python -c 'import playwright' 2>/dev/null || { echo "Adding Playwright to $(VENV) (once) ..." && \
		$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev,browser]'; }
	@touch $@

web-types: $(WEB_READY)
	@rm -rf build/web && mkdir -p build/web/vendor && cp -r actors/web/assets/js tests/browser/jsconfig.json build/web/
	@sed 's/^export = cytoscape;/export default cytoscape;/' $(NPM)/node_modules/cytoscape/index.d.ts \
		> build/web/vendor/cytoscape.esm.min.d.mts
	@cp $(NPM)/node_modules/uplot/dist/uPlot.d.ts build/web/vendor/uPlot.esm.d.ts
	@cp -r $(NPM)/node_modules/@dagrejs/dagre/dist/types build/web/vendor/
	@cp $(NPM)/node_modules/@dagrejs/dagre/dist/dagre.d.ts build/web/vendor/dagre.esm.d.ts
	$(NPM)/node_modules/.bin/tsc --project build/web/jsconfig.json

# Node.js takes the page's scripts for modules in build/web, where the package says so.
web-unit: web-types
	@cp -r tests/browser/unit build/web/ && echo '{"type": "module"}' > build/web/package.json
	@cd build/web && node --test --test-reporter=dot unit/*.test.mjs

WEB_WORKERS ?= auto

web-test: web-unit
	@$(BIN)/python -m pytest --numprocesses=$(WEB_WORKERS) tests/browser $(PYTEST_FLAGS)

# The page in front of 500 nodes: how long it loads and answers, what it holds, what it costs the broker.
web-bench: $(WEB_READY)
	@mkdir -p build && $(BIN)/python benchmarks/web.py --json build/web-bench.json

clean:
	rm -rf $(VENV) build dist *.egg-info .hypothesis .mypy_cache .pytest_cache .ruff_cache
