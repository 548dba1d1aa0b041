#!/usr/bin/env bash
# roots_test.sh FOLDER [SUITE...]: the README's commands from a clone of this checkout in a bare Debian 12 and in a bare
# Debian 13 below FOLDER, a wheel made there and used in another bare root, and a trial in a bare testing, where EGL draws.
# As root; an hour and more on two cores. With suites (bookworm, trixie, testing) these alone.
set -euo pipefail
folder=$(realpath -m "$1")
here=$(realpath "$(dirname "$0")")
mkdir -p "$folder"
suites=("${@:2}")
if [ ${#suites[@]} = 0 ]; then suites=(bookworm trixie testing); fi

# in_root SUITE COMMAND: in a clone; says how long it took and how many processor seconds.
in_root() {
  local TIMEFORMAT="== $1: $2: %0R s, of processors %0U + %0S s"
  time unshare --mount --pid --fork --mount-proc="$folder/roots-$1/proc" chroot "$folder/roots-$1" \
    /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 \
    sh -c "cd /root/turbidock && $2"
}

# docked_by_egl: one trial, where there is no OSMesa.
docked_by_egl() {
  in_root testing 'make build'
  in_root testing 'build/bin/turbidock run pool_active --expect success --json' | tee "$folder/testing.json"
  grep -q '"renderer": "EGL' "$folder/testing.json"
}

for suite in "${suites[@]}"; do
  root=$folder/roots-$suite
  bash "$here/bare_root.sh" "$root" "$suite"
  chroot "$root" sh -c 'apt-get update -q && DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -q --no-install-recommends git make' >"$folder/roots-$suite.log"
  rm -rf "$root/root/turbidock"
  git clone -q "$here/../.." "$root/root/turbidock"
  if [ "$suite" = testing ]; then
    docked_by_egl
    continue
  fi
  in_root "$suite" 'make run'
  in_root "$suite" 'make test'
  in_root "$suite" 'make wheel'
  bash "$here/wheel_test.sh" "$folder/roots-$suite"/root/turbidock/out/wheel/turbidock-*.whl "$folder" "$suite"
done
