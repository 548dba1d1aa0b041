# Two commands on a fresh Debian 12 machine: `make run` and `make test`. Both install what is missing of
# apt-packages.txt (through sudo when not root), configure and build.

JOBS ?= 2
PACKAGES := $(shell sed '/^\#/d' apt-packages.txt)
SUDO := $(if $(filter 0,$(shell id -u)),,sudo)

.PHONY: run test build bench format clean setup configure

run: build
	build/bin/turbidock run sea_night_active --out out/run --video

test: build
	ctest --preset release

build: configure
	cmake --build --preset release -j $(JOBS)

configure: setup
	cmake --preset release $(CMAKE_ARGS)

setup:
	@missing=$$(for p in $(PACKAGES); do \
	  dpkg-query -W -f='$${Status}' $$p 2>/dev/null | grep -q 'ok installed' || echo $$p; done); \
	if [ -n "$$missing" ]; then \
	  echo "installing:" $$missing; \
	  $(SUDO) apt-get update -q && \
	  $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $$missing; \
	fi

bench: build
	for b in build/bin/*_bench; do $$b || exit 1; done

format:
	git ls-files '*.cc' '*.h' | xargs clang-format -i

clean:
	rm -rf build build-debug build-sanitize out
