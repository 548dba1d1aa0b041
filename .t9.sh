V=$PWD/out/venv
cmake --preset release -DTURBIDOCK_PYTHON=ON -DPython_EXECUTABLE="$V/bin/python" -Dpybind11_DIR="$("$V/bin/python" -m pybind11 --cmakedir)" >/dev/null
cmake --build --preset release -j 2 --target turbidock_python 2>&1 | tail -1
cmake --install build --component python --prefix "$("$V/bin/python" -c 'import sysconfig; print(sysconfig.get_path("platlib"))')" >/dev/null
cmake --preset release >/dev/null
(cd tests/python && PROGRAM=/work/main/build/bin/turbidock $V/bin/python -m pytest -q test_scenario.py 2>&1 | tail -2)
