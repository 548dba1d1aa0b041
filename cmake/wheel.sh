#!/usr/bin/env bash
# wheel.sh BUILD FOLDER PYTHON...: the Python package with the program, every library but the C library's and for each of these
# Pythons the module, as one wheel in FOLDER. It asks for the C library whose symbols it uses. BUILD is configured, has the
# program, and ends configured for the last Python.
set -euo pipefail
source "$(dirname "$0")/bundle.sh"
build=$(realpath "$1")
folder=$(realpath -m "$2")
shift 2
work=$folder/work
rm -rf "$folder"
mkdir -p "$work"
"$1" -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'scikit-build-core>=0.9' 'pybind11>=2.13,<3' wheel
"$work/venv/bin/pip" wheel -q --no-deps --no-build-isolation --config-settings=wheel.cmake=false -w "$work" .
"$work/venv/bin/wheel" unpack -d "$work/unpacked" "$work"/turbidock-*.whl >/dev/null
rm "$work"/turbidock-*.whl
top=$(echo "$work"/unpacked/turbidock-*)
tags=
for python in "$@"; do
  # where it is, for a shim says so only when it is asked
  found=$("$python" -c 'import sys; print(sys.executable)')
  cmake -U 'Python_*' -U '_Python*' -U 'FIND_PACKAGE_MESSAGE_DETAILS_Python' -DPython_EXECUTABLE="$found" \
    -Dpybind11_DIR="$("$work/venv/bin/python" -m pybind11 --cmakedir)" -DTURBIDOCK_PYTHON=ON "$build" >/dev/null
  cmake --build "$build" --target turbidock_python
  cmake --install "$build" --component python --prefix "$top" --strip >/dev/null
  tags=$tags.$("$found" -c 'import sys; print(f"cp{sys.version_info[0]}{sys.version_info[1]}")')
done
package=$top/turbidock
bundle "$package/lib" "$package/share/doc/libraries" "$package/bin/turbidock" "$package"/_core.*.so
# shellcheck disable=SC2016  # the loader's $ORIGIN
patchelf --set-rpath '$ORIGIN/../lib' "$package/bin/turbidock"
# shellcheck disable=SC2016
patchelf --set-rpath '$ORIGIN/lib' "$package"/_core.*.so
sed -i 's/^Root-Is-Purelib: .*/Root-Is-Purelib: false/' "$top"/turbidock-*.dist-info/WHEEL
"$work/venv/bin/wheel" pack -d "$work" "$top" >/dev/null
glibc=$(objdump -T "$package/bin/turbidock" "$package"/_core.*.so "$package"/lib/* | grep -o 'GLIBC_[0-9.]*' |
  sort -V | sed -n '$s/GLIBC_//p' | tr . _)
"$work/venv/bin/wheel" tags --remove --python-tag "${tags#.}" --abi-tag none \
  --platform-tag "manylinux_${glibc}_$(uname -m)" "$work"/turbidock-*.whl >/dev/null
mv "$work"/turbidock-*.whl "$folder"
rm -rf "$work"
echo "$folder"/turbidock-*.whl
