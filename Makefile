# Every command of the project. `make` alone lists them.
# On a fresh Debian machine only make itself must be there: apt-get install -y make && make demo

SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

# An active virtual environment is used; without one, .venv is made.
VENV := $(or $(VIRTUAL_ENV),$(CURDIR)/.venv)
PY := $(VENV)/bin/python
SUDO := $(if $(filter 0,$(shell id -u)),,sudo)
export CTEST_OUTPUT_ON_FAILURE := 1
# Ninja alone would take two more, and check runs it beside the tests of Python and firmware.
export CMAKE_BUILD_PARALLEL_LEVEL := $(shell nproc)

# What Debian provides: to build and run, and beyond that to test and lint.
PACKAGES := g++ cmake ninja-build libeigen3-dev libxsimd-dev python3-dev python3-venv
FIRMWARE_PACKAGES := arduino-builder arduino-core-avr gcc-avr avr-libc binutils-avr \
    simavr libsimavr-dev libelf-dev \
    gcc-arm-none-eabi libnewlib-arm-none-eabi libstdc++-arm-none-eabi-newlib qemu-system-arm \
    gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf qemu-system-misc
# Other packages of Node.js than Debian's bring npm with them, and do not bear Debian's npm beside them.
NODE_PACKAGES := $(if $(shell command -v npm),,nodejs npm)
WASM_PACKAGES := lld wasi-libc libclang-rt-14-dev-wasm32 libc++-14-dev-wasm32 $(NODE_PACKAGES)
DEV_PACKAGES := $(PACKAGES) $(FIRMWARE_PACKAGES) $(WASM_PACKAGES) \
    clang libclang-rt-dev doctest-dev clang-format valgrind chromium libjs-katex

CXX_FILES = $(shell find cpp firmware tests -name '*.hpp' -o -name '*.cpp' -o -name '*.h')
# What the Python module is compiled from.
CORE_FILES := pyproject.toml CMakeLists.txt $(shell find cpp/include cpp/desk cpp/bindings cpp/cmake cpp/licences -type f)

.PHONY: help
help: ## list the commands
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "%-17s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

# ---- Install -------------------------------------------------------------------------------------

# $(call apt,PACKAGES): installs those that are missing.
apt = missing=$$(comm -23 <(tr ' ' '\n' <<< "$(1)" | sort) \
	    <(dpkg-query -W -f '$${db:Status-Status} $${Package}\n' | sed -n 's/^installed //p' | sort)); \
	if [ -n "$$missing" ]; then \
	    $(SUDO) apt-get update -q && \
	    $(SUDO) env DEBIAN_FRONTEND=noninteractive \
	        apt-get install -qy --no-install-recommends $$missing; \
	fi

# $(call listed,NAME): the packages of a list in pyproject.toml.
listed = $(shell sed -nE 's/^$(1) = \[(.*)\]/\1/p' pyproject.toml | tr -d '",')

# The build requirements of pyproject.toml live in the environment: an isolated build would bring
# pybind11 to a new place each time and compile everything again.
BUILD_REQUIRES = $(call listed,requires)
PIP_INSTALL = $(PY) -m pip install --quiet --disable-pip-version-check

# Users get the newest packages within the bounds of pyproject.toml; tests and linters run with those
# of tests/requirements.lock, to the byte.
.PHONY: setup setup-dev install install-editable lock
setup: $(VENV)/.auvest-setup ## install what is missing: Debian packages to build, .venv
setup-dev: $(VENV)/.auvest-setup-dev ## the same, with all that the tests and linters need
install: $(VENV)/.auvest-normal ## install the Python package and the command auvest
install-editable: $(VENV)/.auvest-editable ## install it so that edits of Python files act at once

$(VENV)/.auvest-setup: pyproject.toml
	$(call apt,$(PACKAGES))
	test -x $(PY) || python3 -m venv $(VENV)
	touch $@

$(VENV)/.auvest-setup-dev: $(VENV)/.auvest-setup tests/requirements.lock
	$(call apt,$(DEV_PACKAGES))
	$(PIP_INSTALL) --require-hashes -r tests/requirements.lock
	touch $@

$(VENV)/.auvest-build-requires: $(VENV)/.auvest-setup
	$(PIP_INSTALL) $(foreach r,$(BUILD_REQUIRES),'$(r)')
	touch $@

$(VENV)/.auvest-release: $(VENV)/.auvest-build-requires
	$(PIP_INSTALL) $(foreach r,$(call listed,release),'$(r)')
	touch $@

lock: setup ## renew tests/requirements.lock: the newest packages within the bounds of pyproject.toml
	test -x build/lock/bin/uv || { python3 -m venv build/lock && build/lock/bin/pip install -q uv; }
	printf '%s\n' $(foreach r,$(BUILD_REQUIRES),'$(r)') > build/lock/build.in
	build/lock/bin/uv pip compile --quiet --upgrade --universal --python-version 3.10 \
	    --generate-hashes --no-annotate --custom-compile-command 'make lock' \
	    --extra test --extra dev --extra docs --extra release \
	    --output-file tests/requirements.lock pyproject.toml build/lock/build.in

$(VENV)/.auvest-normal: $(VENV)/.auvest-build-requires $(CORE_FILES) $(shell find python -name '*.py' -o -name '*.pyi')
	$(PIP_INSTALL) --no-build-isolation .
	rm -f $(VENV)/.auvest-editable && touch $@

$(VENV)/.auvest-editable: $(VENV)/.auvest-setup-dev $(CORE_FILES)
	$(PIP_INSTALL) --no-build-isolation --no-deps --editable .
	rm -f $(VENV)/.auvest-normal && touch $@

# ---- Use -----------------------------------------------------------------------------------------

.PHONY: demo reproduce docs wheel library page release
demo: install ## install and run the first two simulations: tables and the paths of figures
	$(VENV)/bin/auvest simulate aukf
	$(VENV)/bin/auvest simulate slatf

reproduce: install ## every table and figure of the papers, beside ours
	$(VENV)/bin/auvest reproduce aukf
	$(VENV)/bin/auvest reproduce slatf
	$(VENV)/bin/auvest reproduce mekf

docs: install-editable ## the documentation site in build/site: tutorials are run, links checked
	rm -rf build/docs build/site
	$(PY) -m sphinx -b html -W --keep-going -q -j 2 -d build/docs -c docs/site . build/site
	@echo build/site/index.html

wheel: $(VENV)/.auvest-build-requires ## a wheel of the package in dist/
	$(PY) -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .
	@ls dist/*.whl

library: install ## the Arduino library: a zip in dist/
	mkdir -p dist && $(VENV)/bin/auvest library --output dist

page: install-editable ## the page where the firmware runs: dist/page.html
	$(PY) -m firmware.browser.build

# All of them are made anew, so that nothing older is among the checksums. Wheels for further Pythons,
# each compiled from nothing: make release PYTHONS="python3.12 python3.13"
PYTHONS :=
release: $(VENV)/.auvest-release ## all that is published, in dist/: packages, documentation, checksums
	rm -rf dist
	$(PY) -m build --sdist --no-isolation --outdir dist .
	$(MAKE) wheel library page docs
	for python in $(PYTHONS); do \
	    $$python -m pip wheel --quiet --no-deps --wheel-dir dist dist/auvest-*.tar.gz; \
	done
	$(PY) python/release.py dist build/site
	@cat dist/SHA256SUMS

# The simulated board, and the sketch tracking_loop compiled for it.
.PHONY: board capture
board: library ## the simulated MEGA2560 and the sketch tracking_loop for it, in build/
	cmake -S . -B build/firmware --log-level=WARNING -D AUVEST_BUILD_FIRMWARE=ON
	cmake --build build/firmware
	$(PY) -m auvest.firmware.sketch firmware/library/examples/tracking_loop \
	    --library dist/auvest-*.zip --output build/sketch

capture: board install ## run tracking_loop on the simulated board: table and picture of the track
	AUVEST_BOARD=build/firmware/firmware/board/auvest-board $(VENV)/bin/auvest capture \
	    --simulator build/sketch/tracking_loop/tracking_loop.ino.elf

# ---- Test ----------------------------------------------------------------------------------------

.PHONY: test test-cpp test-cpp-matrix test-firmware test-python fuzz
test: test-python test-firmware test-cpp test-cpp-matrix fuzz ## all tests

test-python: install-editable ## the Python tests
	$(PY) -m pytest tests/python

test-firmware: install-editable ## the library, the sketches on the simulated board, parity
	$(PY) -m pytest tests/firmware tests/parity

test-cpp: build-release ## the C++ tests that run for seconds, optimised, and the examples
	ctest --test-dir build/release --parallel 2

# All of them with the other compiler and the newest standard, under the address and
# undefined-behaviour sanitizers; build-release has gcc and C++11, the Python module C++17. (Any pair
# has a target; each takes minutes.) Those that run for seconds are left to build-release, unless
# AUVEST_SLOW_TESTS is set. That benchmarks and tools compile is shown here, too. A sanitizer's
# report names functions; for their lines, too: DEBUG_INFO=-g1.
MATRIX := matrix-clang-20
DEBUG_INFO := -g0
PAIRS := $(foreach compiler,gcc clang,$(foreach std,11 14 17 20,matrix-$(compiler)-$(std)))
test-cpp-matrix: $(MATRIX) ## the C++ tests under sanitizers: clang, C++20

.PHONY: $(PAIRS) build-release
$(PAIRS): matrix-%: setup-dev
	cmake -S . -B build/$@ -G Ninja --log-level=WARNING -D AUVEST_BUILD_TESTS=ON \
	    -D AUVEST_BUILD_BENCHMARKS=ON -D AUVEST_BUILD_TOOLS=ON -D AUVEST_SYNTAX_ONLY=ON \
	    -D AUVEST_LONG_TESTS=$(if $(AUVEST_SLOW_TESTS),ON,OFF) \
	    -D AUVEST_SANITIZE=ON -D CMAKE_BUILD_TYPE=Debug -D CMAKE_CXX_FLAGS_DEBUG=$(DEBUG_INFO) \
	    -D CMAKE_CXX_COMPILER=$(if $(findstring clang,$@),clang++,g++) \
	    -D CMAKE_CXX_STANDARD=$(lastword $(subst -, ,$@))
	cmake --build build/$@
	ctest --test-dir build/$@ --parallel 2

build-release: setup-dev
	cmake -S . -B build/release -G Ninja --log-level=WARNING -D AUVEST_BUILD_TESTS=ON \
	    -D AUVEST_LONG_TESTS=ONLY -D AUVEST_BUILD_EXAMPLES=ON
	cmake --build build/release

# What libFuzzer finds goes to build/fuzz/crash-*. A long run is worth optimised code:
# make fuzz SECONDS=1800 FUZZ_BUILD=Release
SECONDS := 15
PRECISION := float
FUZZ_BUILD := Debug
fuzz: setup-dev ## libFuzzer on the filters: SECONDS=15, PRECISION=float
	cmake -S . -B build/fuzz/$(FUZZ_BUILD) -G Ninja --log-level=WARNING -D AUVEST_BUILD_FUZZ=ON \
	    -D CMAKE_BUILD_TYPE=$(FUZZ_BUILD) -D CMAKE_CXX_FLAGS_DEBUG='-O0 -g1' \
	    -D CMAKE_CXX_FLAGS_RELEASE='-O1 -g1' -D CMAKE_CXX_COMPILER=clang++
	cmake --build build/fuzz/$(FUZZ_BUILD) --target fuzz_$(PRECISION)
	build/fuzz/$(FUZZ_BUILD)/tests/attacks/fuzz_$(PRECISION) -artifact_prefix=build/fuzz/ \
	    -max_total_time=$(SECONDS) -timeout=60 -print_final_stats=1 -print_funcs=0 -verbosity=0

# ---- Measure -------------------------------------------------------------------------------------

.PHONY: bench math-accuracy build-measure
build-measure: setup-dev
	cmake -S . -B build/measure -G Ninja --log-level=WARNING -D AUVEST_BUILD_BENCHMARKS=ON \
	    -D AUVEST_BUILD_TOOLS=ON
	cmake --build build/measure

bench: build-measure install-editable ## time per step beside filterpy, NumPy, Numba; time to start
	$(PY) cpp/benchmarks/speed.py build/measure/cpp/benchmarks/ukf_step --write docs/speed.md
	OPENBLAS_NUM_THREADS=1 $(PY) cpp/benchmarks/slat_speed.py \
	    build/measure/cpp/benchmarks --write docs/speed_slat.md
	OPENBLAS_NUM_THREADS=1 $(PY) cpp/benchmarks/vehicle_speed.py \
	    build/measure/cpp/benchmarks --write docs/speed_vehicle.md
	$(PY) cpp/benchmarks/many_runs.py --write docs/speed_runs.md
	$(PY) cpp/benchmarks/startup.py --write docs/speed_startup.md

math-accuracy: build-measure ## errors of the float functions over all 2^32 arguments
	build/measure/cpp/tools/math_accuracy

# ---- Check ---------------------------------------------------------------------------------------

.PHONY: format lint typecheck check clean
format: install-editable ## rewrite all files in the project's format
	$(VENV)/bin/ruff format .
	$(VENV)/bin/ruff check --fix .
	clang-format -i $(CXX_FILES)

lint: install-editable ## ruff and clang-format, changing nothing
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	clang-format --dry-run -Werror $(CXX_FILES)

typecheck: install-editable ## mypy, and the stub of the compiled module against the module
	$(VENV)/bin/mypy
	MYPYPATH=python $(VENV)/bin/stubtest auvest._core

# Two at a time: the tests of Python and firmware use one processor, the compilers all.
check: install-editable ## all of these; what CI runs
	$(MAKE) --jobs=2 --output-sync=target lint typecheck test

clean: ## remove what was built (.venv stays)
	rm -rf build dist $(VENV)/.auvest-*
	find . -path ./.venv -prune -o -name __pycache__ -prune -exec rm -rf {} +
