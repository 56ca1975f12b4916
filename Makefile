# The way in: `make demo` shows the method at work, `make test` tests it. Both set up all they need in .venv.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
OUT    ?= demo
COUNT  ?= 100000
POINTS ?= 20 60 200
PREFIX ?= /usr/local

# What the compiled module is made from; a change of any rebuilds it.
SOURCES := $(shell find crates/surfsig crates/surfsig-python -name '*.rs' -o -name '*.bin' -o -name Cargo.toml) Cargo.toml Cargo.lock pyproject.toml

# The page's tools, from npm; nothing where node is missing.
NODE := $(shell command -v node 2>/dev/null)

.PHONY: page test-web bench-page help demo test test-all test-rust test-python lint format bench bench-reading bench-error bench-segmentation bench-intervals bench-registration bench-finding bench-odometry bench-trust bench-covariance bench-multiway fuzz docs tour wheel check-wheel header install-c clean build bench-scale
.DEFAULT_GOAL := help

help: ## Say what there is to make
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-18s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

demo: build ## Run the main job and draw it into demo/
	$(BIN)/python examples/demo.py $(OUT)
	$(BIN)/surfsig paper --out $(OUT)/paper

test: build test-rust ## Run the quick tests: Rust, its doc examples, Python without the slow ones
	$(BIN)/python -m pytest

test-all: test-rust test-python ## Run all tests, the slow ones too

test-rust: ## Run the tests of Rust, and its doc examples
	cargo test --release --workspace --quiet

test-python: build ## Run all tests of Python, the slow ones too
	$(BIN)/python -m pytest -m ""

lint: build ## Formatters, linters and type checkers
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --quiet -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --quiet
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest surfsig._surfsig
ifdef NODE
	$(MAKE) web/node_modules/.built
	cd web && npm run --silent check
endif

page: web/node_modules/.built ## Build the page: the core in WebAssembly, and the viewer of all reports
	cd web && node build_engine.mjs && node build.mjs

# The browser that tests and benchmarks of the page drive.
CHROMIUM ?= $(firstword $(wildcard /usr/bin/chromium /usr/bin/chromium-browser /usr/bin/google-chrome))
export CHROMIUM

test-web: build ## Test the page in Chromium; skipped, with the reason, where Chromium or node is missing
ifndef NODE
	@echo "skipped: node is missing (https://nodejs.org), which drives the browser"
else ifeq ($(CHROMIUM),)
	@echo "skipped: Chromium is not installed (Debian: apt install chromium), nor named by CHROMIUM="
else
	$(MAKE) web/node_modules/.built
	cd web && PYTHON=$(CURDIR)/$(BIN)/python node --test tests/*.test.mjs
endif

bench-page: build web/node_modules/.built ## Time the page in Chromium beside one native thread, and write that part of BENCHMARKS.md
	$(BIN)/python benchmarks/page.py --write

web/node_modules/.built: web/package-lock.json
	@command -v npm >/dev/null || { echo "npm is missing: install Node.js 20 or later from https://nodejs.org" >&2; exit 1; }
	cd web && npm ci --no-audit --no-fund --loglevel=error
	@touch $@

format: $(VENV)/.tools ## Format all code
	cargo fmt --all
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .
ifdef NODE
	$(MAKE) web/node_modules/.built
	cd web && npx prettier --log-level warn --write .
endif

bench: build ## Time surfsig and its peers in one run, and write BENCHMARKS.md
	$(BIN)/python benchmarks/run.py --write

bench-reading: build ## Time the reading of files, and write that table of BENCHMARKS.md
	$(BIN)/python benchmarks/reading.py --write

bench-error: build ## Measure the error of curvature beside CGAL's jets, and write BENCHMARKS.md and docs/fits.md
	$(BIN)/python benchmarks/curvature_error.py --write

bench-segmentation: build ## Score the surfaces found in clouds of known ones, and write that part of BENCHMARKS.md
	$(BIN)/python benchmarks/segmentation.py --write

bench-intervals: build ## Count the intervals that hold the sizes of surfaces found, and write that part of BENCHMARKS.md
	$(BIN)/python benchmarks/intervals.py --write

bench-registration: build ## Register pairs of scans beside the peers, and write that part of BENCHMARKS.md
	$(BIN)/python benchmarks/registration.py --write

bench-finding: build ## Look for objects in simulated and real scenes, and write that part of BENCHMARKS.md
	$(BIN)/python benchmarks/finding.py --write

bench-odometry: build ## Follow sensors through a simulated building, and write that part of BENCHMARKS.md
	$(BIN)/python benchmarks/odometry.py --write

bench-trust: build ## Register pairs that deceive, and write that part of BENCHMARKS.md
	$(BIN)/python benchmarks/trust.py --write

bench-covariance: build ## Compare errors of poses with their covariances, and write that part of BENCHMARKS.md
	$(BIN)/python benchmarks/covariance.py --write

bench-multiway: build ## Register many scans at once, and write that part of BENCHMARKS.md
	$(BIN)/python benchmarks/multiway.py --write

bench-scale: build ## Work on millions of points in tiles, and write that part of BENCHMARKS.md: make bench-scale POINTS="20 60 200"
	$(BIN)/python benchmarks/scale.py --points $(POINTS) --write

fuzz: build ## Read damaged files of all formats: make fuzz COUNT=100000
	$(BIN)/python fuzz/mutate.py --count $(COUNT)

docs: build ## Build the API reference: target/doc (Rust) and build/docs (Python, the C headers)
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps
	$(BIN)/python -W error -m pdoc --docformat numpy --output-directory build/docs surfsig
	cp crates/surfsig-c/include/*.h crates/surfsig-c/include/*.hpp build/docs

tour: build ## Run the code of docs/tour.md, and draw its pictures
	$(BIN)/python examples/tour.py

wheel: $(VENV)/.tools ## Build the wheel, for all Pythons from 3.10 on, into dist/
	rm -rf dist
	$(BIN)/maturin build --release --strip --out dist

check-wheel: wheel ## Use the wheel in an empty environment of each Python at hand
	$(BIN)/python scripts/check_distribution.py dist/*.whl

header: ## Write the C header anew from the sources
	SURFSIG_WRITE_HEADER=1 cargo test --release --package surfsig-c --test header --quiet

install-c: ## Install the C and C++ interface: make install-c PREFIX=/usr/local
	cmake -S crates/surfsig-c -B build/c
	cmake --build build/c
	cmake --install build/c --prefix $(PREFIX)

clean: ## Remove everything that was built
	rm -rf $(VENV) target build dist web/node_modules web/dist $(OUT)

build: $(VENV)/.built

# A virtual environment of the project's own: no sudo, and nothing of the system's Python is touched.
$(VENV)/.tools: pyproject.toml
	@command -v cargo >/dev/null || { echo "cargo is missing: install Rust from https://rustup.rs, then run make again" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade "pip>=25.1"
	$(BIN)/python -m pip install --quiet --group dev
	@touch $@

$(VENV)/.built: $(VENV)/.tools $(SOURCES)
	VIRTUAL_ENV=$(CURDIR)/$(VENV) $(BIN)/maturin develop --release --quiet --extras all
	@touch $@
