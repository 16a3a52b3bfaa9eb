# Fresh machine: `make demo` and `make test` do their own set-up. `make help` lists the rest.
SHELL := /bin/bash
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
BUILD := build/cpp
# root needs no sudo; anybody else is asked for it only when a package is missing.
SUDO := $(shell [ "$$(id -u)" = 0 ] || echo sudo)
# Memory, not cores, limits parallel Eigen builds: about 1.5 GB a job.
JOBS ?= $(shell nproc)
CPP_FILES := $(shell find cpp bindings tests benchmarks examples -name '*.hpp' -o -name '*.cpp' -o -name '*.h' -o -name '*.c' 2>/dev/null)
SOURCES := $(shell find cpp bindings -type f) CMakeLists.txt pyproject.toml

.PHONY: help setup demo test test-cpp test-python test-install test-aarch64 warnings firmware lint format stubs bench clean

help: ## show this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 14

setup: $(VENV)/.installed ## Debian packages, virtual environment, build

demo: setup ## simulate, estimate with both methods, evaluate, draw
	$(BIN)/tensegrity demo --out runs/demo

test: test-cpp test-python ## all tests

# By clang++, which takes half of g++'s time for Eigen; g++ builds the package, which test-python
# tests, and all that test-install and test-aarch64 run.
test-cpp: $(BUILD)/build.ninja
	cmake --build $(BUILD) -j $(JOBS)
	ctest --test-dir $(BUILD) --output-on-failure

$(BUILD)/build.ninja: $(VENV)/.installed
	cmake -S . -B $(BUILD) -G Ninja -DCMAKE_CXX_COMPILER=clang++ \
	  -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS_RELEASE='-O2 -DNDEBUG' -DTENSEGRITY_BUILD_C=ON \
	  -DTENSEGRITY_BUILD_TESTS=ON > $(BUILD).log 2>&1 || { cat $(BUILD).log; exit 1; }
	@touch $@

test-install: $(BUILD)/build.ninja ## the installed tree: CMake, pkg-config, C, all examples
	cmake --build $(BUILD) -j $(JOBS) --target tensegrity_ipopt tensegrity_c
	rm -rf $(BUILD)/recording
	$(BIN)/tensegrity simulate forward --path-length 0.5 --out $(BUILD)/recording
	JOBS=$(JOBS) tests/packaging/test_install.sh $(BUILD) $(BUILD)/recording

warnings: build/.debian ## no warning in headers and libraries, g++ and clang++
	tests/packaging/warnings.sh $(JOBS)

# A part of the tests, because every file of Eigen takes its time; AARCH64_TESTS='.*' takes all.
AARCH64 := build/aarch64
AARCH64_RUN := qemu-aarch64 -L /usr/aarch64-linux-gnu
AARCH64_TESTS ?= math.*|chi_square|shape_solver|estimator_tight

test-aarch64: build/.debian ## core in double and C library in float on emulated 64-bit ARM
	@mkdir -p $(AARCH64)
	cmake -S . -B $(AARCH64) -G Ninja --toolchain cpp/cmake/aarch64-linux-gnu.cmake \
	  -DCMAKE_BUILD_TYPE= -DCMAKE_CXX_FLAGS=-O1 -DTENSEGRITY_BUILD_IPOPT=OFF \
	  -DTENSEGRITY_BUILD_C=ON -DTENSEGRITY_C_SCALAR=float \
	  -DTENSEGRITY_BUILD_TESTS=ON -DTENSEGRITY_TESTS='$(AARCH64_TESTS)' > $(AARCH64).log 2>&1 \
	  || { cat $(AARCH64).log; exit 1; }
	cmake --build $(AARCH64) -j $(JOBS)
	$(AARCH64_RUN) $(AARCH64)/tests/c/tensegrity_c_tests
	$(AARCH64_RUN) $(AARCH64)/tests/cpp/tensegrity_tests

test-python: setup
	$(BIN)/python -m pytest -n $(JOBS)

# Images for both boards and the same replay on this machine; docs/firmware.md.
FIRMWARE := build/firmware
FIRMWARE_BOARDS := mps2-an500 mps2-an386

firmware: setup ## the estimator on emulated Cortex-M boards, without a heap, against this machine
	$(BIN)/python examples/firmware/make_recording.py $(FIRMWARE)/recording.bin
	cmake -S examples/firmware -B $(FIRMWARE)/host -G Ninja
	cmake --build $(FIRMWARE)/host -j $(JOBS)
	set -e; for board in $(FIRMWARE_BOARDS); do \
	  cmake -S examples/firmware -B $(FIRMWARE)/$$board -G Ninja \
	    --toolchain $(CURDIR)/examples/firmware/arm-none-eabi.cmake \
	    -DBOARD=$$board -DRECORDING=$(CURDIR)/$(FIRMWARE)/recording.bin; \
	  cmake --build $(FIRMWARE)/$$board -j $(JOBS); \
	  ctest --test-dir $(FIRMWARE)/$$board --output-on-failure; \
	done
	$(BIN)/python examples/firmware/check.py $(FIRMWARE)

lint: setup ## formatters, linters, type checker, stubs
	$(BIN)/clang-format --dry-run --Werror $(CPP_FILES)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/python benchmarks/report.py --check
	$(BIN)/python bindings/make_stubs.py build/_core.pyi
	diff -u python/tensegrity/_core.pyi build/_core.pyi

format: setup ## format all code
	$(BIN)/clang-format -i $(CPP_FILES)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

stubs: setup ## write python/tensegrity/_core.pyi from the built module
	$(BIN)/python bindings/make_stubs.py python/tensegrity/_core.pyi

bench: $(VENV)/.bench ## times and instructions, peers beside them: docs/benchmarks.md
	JOBS=$(JOBS) $(BIN)/python benchmarks/run.py

clean: ## remove builds and the virtual environment
	rm -rf build $(VENV) runs

# ---- set-up steps, each run only when what it depends on has changed

build/.debian: .ci/debian-packages.txt
	@mkdir -p build
	@missing=$$(for p in $$(grep -v '^#' $<); do \
	    dpkg-query -W -f '$${Status}' $$p 2>/dev/null | grep -q 'ok installed' || echo $$p; done); \
	if [ -n "$$missing" ]; then \
	  $(SUDO) apt-get update && $(SUDO) apt-get install -y --no-install-recommends $$missing; fi
	@touch $@

$(VENV)/bin/pip: build/.debian
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --upgrade pip

# Without build isolation the C++ build directory stays valid, and a rebuild is incremental.
$(VENV)/.installed: $(SOURCES) $(VENV)/bin/pip
	$(BIN)/pip install --quiet "scikit-build-core>=0.10" "pybind11>=3.0" "numpy>=1.26"
	CMAKE_BUILD_PARALLEL_LEVEL=$(JOBS) $(BIN)/pip install --quiet --no-build-isolation -e '.[dev]'
	@touch $@

$(VENV)/.bench: $(VENV)/.installed
	$(BIN)/pip install --quiet --no-build-isolation -e '.[bench]'
	@touch $@
