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
CPP_FILES := $(shell find cpp bindings tests/cpp benchmarks examples -name '*.hpp' -o -name '*.cpp' 2>/dev/null)
SOURCES := $(shell find cpp bindings -type f) CMakeLists.txt pyproject.toml

.PHONY: help setup demo test test-cpp test-python firmware lint format stubs bench clean

help: ## show this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 14

setup: $(VENV)/.installed ## Debian packages, virtual environment, build

demo: setup ## simulate, estimate with both methods, evaluate, draw
	$(BIN)/tensegrity demo --out runs/demo

test: test-cpp test-python ## all tests

test-cpp: setup
	cmake -S . -B $(BUILD) -G Ninja -DCMAKE_BUILD_TYPE=Release -DTENSEGRITY_BUILD_TESTS=ON -DTENSEGRITY_BUILD_EXAMPLES=ON > $(BUILD).log 2>&1 \
	  || { cat $(BUILD).log; exit 1; }
	cmake --build $(BUILD) -j $(JOBS)
	ctest --test-dir $(BUILD) --output-on-failure

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
