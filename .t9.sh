bash .b1.sh > /tmp/h/nc_build2.log 2>&1
V=$PWD/out/venv
"$V/bin/pip" install -q --no-build-isolation --config-settings=wheel.cmake=false '.[test]'
cmake --install build --component python --prefix "$("$V/bin/python" -c 'import sysconfig; print(sysconfig.get_path("platlib"))')" >/dev/null
(cd tests/python && PROGRAM=/work/main/build/bin/turbidock $V/bin/python -m pytest -q test_scenario.py test_trial.py -k "undoes or ctrl_c or switched or mapping or once or run_is" 2>&1 | tail -5)
(cd out && $V/bin/python -m mypy --cache-dir mypy --strict -p turbidock)
grep -n "error:" /tmp/h/nc_build2.log | cut -c1-200
