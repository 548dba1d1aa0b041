# Two commands on a fresh Debian 12 or 13: `make run` and `make test`. Both install what is missing of apt-packages.txt
# (through sudo when not root), configure and build. `make help` lists the others.

JOBS ?= 2
SUDO := $(if $(filter 0,$(shell id -u)),,sudo)
# The parts of apt-packages.txt that each command needs.
RUN_PACKAGES := $(shell sed '/^\# tests/,$$d; /^\#/d' apt-packages.txt)
TEST_PACKAGES := $(shell sed '/^\# python/,$$d; /^\#/d' apt-packages.txt)
PYTHON_PACKAGES := $(RUN_PACKAGES) $(shell sed -n '/^\# python/,/^\# continuous/{/^\#/!p}' apt-packages.txt)
CI_PACKAGES := $(shell sed '/^\#/d' apt-packages.txt)

# From nothing a module's sources compile faster some at a time; who goes on to edit them may want
# CMAKE_ARGS=-DTURBIDOCK_UNITY=OFF.
FROM_NOTHING := $(if $(wildcard build/CMakeCache.txt),,-DTURBIDOCK_UNITY=ON)

.PHONY: run test build build-tests bench fuzz faults mutation soak package tarball wheel container format clean ci-setup \
  python-setup help docs release

run: build  ## builds, then runs the published docking trial at night, filmed, to out/run/
	@echo "== trial: the published docking at night, filmed, to out/run/ (about a minute)"
	build/bin/turbidock run paper_sea_night_active --out out/run --video

# A list of targets: the line of each that ends in `## what it does`.
help:
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-12s %s\n", $$1, $$2}' Makefile

build:  ## the program alone, at build/bin/turbidock
	@$(call install,$(RUN_PACKAGES))
	@echo "== build: the program (7 to 8 minutes on two cores the first time), at build/bin/turbidock"
	@cmake --preset release -DTURBIDOCK_TESTS=OFF -DTURBIDOCK_BENCHMARKS=OFF $(FROM_NOTHING) $(CMAKE_ARGS)
	cmake --build --preset release -j $(JOBS)

test: build-tests  ## builds program and tests, then runs all tests
	@echo "== test: all tests (about 4 minutes on two cores)"
	ctest --preset release -j $(JOBS)

build-tests:  ## the program and its tests
	@$(call install,$(TEST_PACKAGES))
	@echo "== build: the program and its tests (8 to 15 minutes on two cores the first time)"
	@cmake --preset release -DTURBIDOCK_TESTS=ON -DTURBIDOCK_BENCHMARKS=ON $(FROM_NOTHING) $(CMAKE_ARGS)
	cmake --build --preset release -j $(JOBS)

bench: build-tests  ## micro-benchmarks of the stages
	for b in build/bin/*_bench; do $$b || exit 1; done

# What reads users' files and requests (FUZZERS of it), SECONDS each, under libFuzzer or (ENGINE=afl) AFL++; see
# tests/fuzz/README.md.
SECONDS ?= 60
ENGINE ?= libfuzzer
FUZZ_PRESET := $(if $(filter afl,$(ENGINE)),fuzz-afl,sanitize)
fuzz: ci-setup  ## each fuzzer for SECONDS
	cmake --preset $(FUZZ_PRESET) -DTURBIDOCK_WERROR=ON $(CMAKE_ARGS) >/dev/null
	cmake --build --preset $(FUZZ_PRESET) -j $(JOBS) --target turbidock_fuzzers
	JOBS=$(JOBS) bash tests/fuzz/run.sh build-$(FUZZ_PRESET) $(SECONDS) $(FUZZERS)

# Faults of the machine through the real program, with KILLS kills at random instants; as root.
KILLS ?= 40
faults: build ci-setup  ## kills, full disks, odd surroundings (as root)
	PROGRAM=build/bin/turbidock KILLS=$(KILLS) python3 tests/faults/faults_test.py

# What `pip install .` needs (experiments/python/README.md).
python-setup:  ## packages that `pip install .` needs
	@$(call install,$(PYTHON_PACKAGES))

# Faults planted in the core, by hand and COUNT drawn at random, and which tests notice: in a clone with a build of its
# own.
COUNT ?= 200
mutation: ci-setup  ## faults planted in the core, and which tests notice
	/usr/bin/python3 tests/mutation/mutate.py planted drawn --count $(COUNT) --jobs $(JOBS)

# TRIALS short trials in one worker, then eight hours and more of simulated docking: memory, descriptors and
# time a trial stay as they are.
TRIALS ?= 10000
soak: build  ## 8 hours of simulated docking: memory and time stay
	python3 tests/faults/soak.py build/bin/turbidock --trials $(TRIALS)
	python3 tests/faults/soak.py build/bin/turbidock --trials 1500 --seconds 20

# The Debian package, to out/deb/, and an image with it for podman or docker.
package:  ## a Debian package, to out/deb/
	@$(call install,$(RUN_PACKAGES))
	cmake --preset release $(CMAKE_ARGS) >/dev/null
	cmake --build --preset release -j $(JOBS) --target turbidock
	rm -rf out/deb
	cpack --config build/CPackConfig.cmake -B out/deb >/dev/null

# The program with all its libraries but the C library's, to out/tarball/.
tarball: build  ## the program with its libraries, to out/tarball/
	@$(call install,patchelf)
	bash cmake/tarball.sh build out/tarball

# The Python package with the program and all libraries but the C library's, to out/wheel/. PYTHONS="python3.10 python3.12"
# makes one for both.
PYTHONS = python3
wheel:  ## a wheel that needs no compiler, to out/wheel/
	@$(call install,$(PYTHON_PACKAGES) python3-venv patchelf)
	cmake --preset release $(CMAKE_ARGS) >/dev/null
	cmake --build --preset release -j $(JOBS) --target turbidock
	CMAKE_BUILD_PARALLEL_LEVEL=$(JOBS) bash cmake/wheel.sh build out/wheel $(PYTHONS)

container: package  ## an image for podman or docker
	podman build -f Containerfile -t turbidock out/deb

# What is tried is what lies in out/release/, its wheel also with each of PYTHONS.
release: package tarball wheel docs  ## all that a release consists of, to out/release/, tried in bare roots (as root)
	rm -rf out/release
	mkdir -p out/release
	cp out/deb/turbidock_*.deb out/tarball/turbidock-*.tar.xz out/wheel/turbidock-*.whl out/release/
	tar -cJf out/release/turbidock-manual-$$(build/bin/turbidock --version | sed -n '1s/turbidock //p').tar.xz -C out docs
	bash tests/package/deb_test.sh out/release/turbidock_*.deb out/bare
	bash tests/package/tarball_test.sh out/release/turbidock-*-$$(uname -m).tar.xz out/bare
	bash tests/package/wheel_test.sh out/release/turbidock-*.whl out/bare
	for python in $(PYTHONS); do \
	  bash tests/package/wheel_test.sh out/release/turbidock-*.whl out/bare $$($$python -c 'import sys; print(sys.executable)') || exit; \
	done
	cd out/release && sha256sum turbidock* >SHA256SUMS && cat SHA256SUMS

# Also what .ci/run needs beyond the tests.
ci-setup:  ## packages that `bash .ci/run` needs
	@$(call install,$(CI_PACKAGES))

# READMEs, the C++ reference and the Python package's, as pages that can be searched.
docs:  ## the manual, to out/docs/index.html
	@$(call install,doxygen)
	python3 cmake/manual.py out/docs
	@echo "== manual: out/docs/index.html"

format:  ## clang-format and prettier over all files
	git ls-files '*.cc' '*.h' | xargs clang-format -i
	npm ci --no-audit --no-fund --prefix tests/page/browser
	git ls-files '*.js' '*.mjs' '*.css' | xargs tests/page/browser/node_modules/.bin/prettier --write

clean:  ## removes all build folders and out/
	rm -rf build build-* out

# Installs those of $(1) that are missing; without root and without sudo it says what an administrator has to type.
# libosmesa6 is left out where Debian has none any more: EGL draws instead.
define install
missing() { \
  for p in $(1); do \
    dpkg-query -W -f='$${Status}' $$p 2>/dev/null | grep -q 'ok installed' && continue; \
    [ $$p = libosmesa6 ] && ! apt-cache show $$p >/dev/null 2>&1 && continue; \
    echo $$p; \
  done | xargs; \
}; \
if [ -n "$$(missing)" ]; then \
  if [ "$$(id -u)" != 0 ] && ! command -v sudo >/dev/null; then \
    echo "== packages are missing, and there is neither root nor sudo. An administrator installs them by"; \
    echo "apt-get install --no-install-recommends $$(missing)"; \
    exit 2; \
  fi; \
  echo "== packages: installs $$(missing | wc -w) of Debian (some minutes): $$(missing)"; \
  mkdir -p out; \
  { $(SUDO) apt-get update -q && \
    $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $$(missing); } \
    >out/packages.log 2>&1 || { tail -20 out/packages.log; echo "== packages: failed; see out/packages.log"; exit 2; }; \
fi
endef
