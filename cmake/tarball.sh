#!/usr/bin/env bash
# tarball.sh BUILD FOLDER: turbidock with every library that it needs but the C library's, as FOLDER/turbidock-*.tar.xz.
# Unpacked anywhere it runs on any Linux whose C library is as new as this machine's; as Debian's package, without films
# and plots where ffmpeg and gnuplot are missing.
set -euo pipefail
source "$(dirname "$0")/bundle.sh"
build=$(realpath "$1")
folder=$(realpath -m "$2")
version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$build/CMakeCache.txt")
name=turbidock-$version-$(uname -m)
top=$folder/$name
rm -rf "$top"
cmake --install "$build" --component program --prefix "$top" --strip >/dev/null
bundle "$top/lib/turbidock" "$top/share/doc/turbidock/libraries" "$top/bin/turbidock"
# shellcheck disable=SC2016  # the loader's $ORIGIN
patchelf --set-rpath '$ORIGIN/../lib/turbidock' "$top/bin/turbidock"
tar -C "$folder" --owner=0 --group=0 --sort=name -c "$name" | xz -T0 >"$folder/$name.tar.xz"
echo "$folder/$name.tar.xz"
