#!/usr/bin/env bash
# tarball.sh BUILD FOLDER: turbidock with every library that it needs but the C library's, as FOLDER/turbidock-*.tar.xz.
# Unpacked anywhere it runs on any Linux whose C library is as new as this machine's; as Debian's package, without films
# and plots where ffmpeg and gnuplot are missing.
set -euo pipefail
build=$(realpath "$1")
folder=$(realpath -m "$2")
version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$build/CMakeCache.txt")
name=turbidock-$version-$(uname -m)
top=$folder/$name
rm -rf "$top"
cmake --install "$build" --component program --prefix "$top" --strip >/dev/null

libraries=$top/lib/turbidock
papers=$top/share/doc/turbidock/libraries
mkdir -p "$libraries" "$papers"
# OSMesa is opened while the program runs.
osmesa=$(ldconfig -p | sed -n 's/.*libOSMesa\.so\.8 .*=> //p' | sed -n 1p)
{
  echo "$osmesa"
  ldd "$top/bin/turbidock" "$osmesa" | awk '$3 ~ "^/" {print $3}'
} | sort -u | while read -r library; do
  # known by one of its two names: /lib is /usr/lib
  package=$({ dpkg-query -S "$library" "$(realpath "$library")" 2>/dev/null || true; } | sed -n '1s/:.*//p')
  if [ "$package" = libc6 ]; then continue; fi  # belongs to the system, with its loader
  cp -L "$library" "$libraries"
  cp -L "/usr/share/doc/$package/copyright" "$papers/$package"
done
# shellcheck disable=SC2016  # the loader's $ORIGIN
patchelf --set-rpath '$ORIGIN/../lib/turbidock' "$top/bin/turbidock"
# shellcheck disable=SC2016
patchelf --set-rpath '$ORIGIN' "$libraries"/*
tar -C "$folder" --owner=0 --group=0 --sort=name -c "$name" | xz -T0 >"$folder/$name.tar.xz"
echo "$folder/$name.tar.xz"
