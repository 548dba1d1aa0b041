# Two commands on a fresh Debian 12 machine: `make run` and `make test`. Both install what is missing of
# apt-packages.txt (through sudo when not root), configure and build.

JOBS ?= 2
SUDO := $(if $(filter 0,$(shell id -u)),,sudo)
# The parts of apt-packages.txt that each command needs.
RUN_PACKAGES := $(shell sed '/^\# tests/,$$d; /^\#/d' apt-packages.txt)
TEST_PACKAGES := $(shell sed '/^\# continuous/,$$d; /^\#/d' apt-packages.txt)
CI_PACKAGES := $(shell sed '/^\#/d' apt-packages.txt)

.PHONY: run test build build-tests bench fuzz faults format clean ci-setup

run: build
	@echo "== the published docking trial at night, filmed, to out/run/ (about a minute)"
	build/bin/turbidock run paper_sea_night_active --out out/run --video

build:
	@echo "== turbidock: packages (some minutes if they are missing), then the program (5 to 10 minutes on" \
	  "two cores the first time), at build/bin/turbidock"
	@$(call install,$(RUN_PACKAGES))
	cmake --preset release -DTURBIDOCK_TESTS=OFF -DTURBIDOCK_BENCHMARKS=OFF $(CMAKE_ARGS)
	cmake --build --preset release -j $(JOBS)

test: build-tests
	@echo "== all tests (about 5 minutes)"
	ctest --preset release

build-tests:
	@echo "== turbidock: packages, then the program and its tests (10 to 20 minutes on two cores the first time)"
	@$(call install,$(TEST_PACKAGES))
	cmake --preset release -DTURBIDOCK_TESTS=ON -DTURBIDOCK_BENCHMARKS=ON $(CMAKE_ARGS)
	cmake --build --preset release -j $(JOBS)

bench: build-tests
	for b in build/bin/*_bench; do $$b || exit 1; done

# Readers of users' files under libFuzzer, SECONDS each; see tests/fuzz/README.md.
SECONDS ?= 60
fuzz: ci-setup
	cmake --preset fuzz $(CMAKE_ARGS) >/dev/null
	cmake --build --preset fuzz -j $(JOBS) --target turbidock_fuzzers
	bash tests/fuzz/run.sh build-fuzz $(SECONDS)

# Faults of the machine through the real program, with KILLS kills at random instants; as root.
KILLS ?= 40
faults: build ci-setup
	PROGRAM=build/bin/turbidock KILLS=$(KILLS) python3 tests/faults/faults_test.py

# Also what .ci/run needs beyond the tests.
ci-setup:
	@$(call install,$(CI_PACKAGES))

format:
	git ls-files '*.cc' '*.h' | xargs clang-format -i

clean:
	rm -rf build build-debug build-sanitize build-fuzz build-tidy out

define install
missing=$$(for p in $(1); do \
  dpkg-query -W -f='$${Status}' $$p 2>/dev/null | grep -q 'ok installed' || echo $$p; done); \
if [ -n "$$missing" ]; then \
  echo "== installing:" $$missing; \
  $(SUDO) apt-get update -q && \
  $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $$missing; \
fi
endef
