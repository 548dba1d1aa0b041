#!/usr/bin/env bash
# wheel.sh BUILD FOLDER: the Python package with its module, the program and every library but the C library's as one wheel
# in FOLDER, for Pythons like the one that BUILD was made with and a C library as new as this machine's.
set -euo pipefail
source "$(dirname "$0")/bundle.sh"
build=$(realpath "$1")
folder=$(realpath -m "$2")
python=$(sed -n 's/^_Python_EXECUTABLE:INTERNAL=//p' "$build/CMakeCache.txt")
glibc=$(ldd --version | sed -n '1s/.* //p' | tr . _)
work=$folder/work
rm -rf "$folder"
mkdir -p "$work"
"$python" -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'scikit-build-core>=0.9' wheel
"$work/venv/bin/pip" wheel -q --no-deps --no-build-isolation --config-settings=wheel.cmake=false -w "$work" .
"$work/venv/bin/wheel" unpack -d "$work/unpacked" "$work"/turbidock-*.whl >/dev/null
rm "$work"/turbidock-*.whl
top=$(echo "$work"/unpacked/turbidock-*)
cmake --install "$build" --component python --prefix "$top" --strip >/dev/null
package=$top/turbidock
bundle "$package/lib" "$package/share/doc/libraries" "$package/bin/turbidock" "$package"/_core.*.so
# shellcheck disable=SC2016  # the loader's $ORIGIN
patchelf --set-rpath '$ORIGIN/../lib' "$package/bin/turbidock"
# shellcheck disable=SC2016
patchelf --set-rpath '$ORIGIN/lib' "$package"/_core.*.so
sed -i 's/^Root-Is-Purelib: .*/Root-Is-Purelib: false/' "$top"/turbidock-*.dist-info/WHEEL
"$work/venv/bin/wheel" pack -d "$work" "$top" >/dev/null
tag=$("$python" -c 'import sys; print(f"cp{sys.version_info[0]}{sys.version_info[1]}")')
"$work/venv/bin/wheel" tags --remove --python-tag "$tag" --abi-tag "$tag" \
  --platform-tag "manylinux_${glibc}_$(uname -m)" "$work"/turbidock-*.whl >/dev/null
mv "$work"/turbidock-*.whl "$folder"
rm -rf "$work"
echo "$folder"/turbidock-*.whl
