#!/usr/bin/env bash
# wheel_test.sh WHEEL FOLDER [SUITE]: in a bare Debian 12, or another suite, below FOLDER with Python alone, an ordinary user
# installs the wheel and docks, from the command line and from Python. As root, where the Python index can be reached.
set -euo pipefail
wheel=$(realpath "$1")
folder=$(realpath -m "$2")
suite=${3:-bookworm}
root=$folder/python-$suite
bash "$(dirname "$0")/bare_root.sh" "$root" "$suite"
chroot "$root" sh -c 'apt-get update -q && DEBIAN_FRONTEND=noninteractive \
  apt-get install -y -q --no-install-recommends python3-venv' >"$folder/python.log"
rm -rf "$root/tmp/user"
install -d -o 1234 -g 1234 "$root/tmp/user"
cp "$wheel" "$root/tmp/user"
as_user() {
  unshare --mount --pid --fork --mount-proc="$root/proc" chroot "$root" /usr/bin/env -i HOME=/tmp/user PATH=/usr/bin:/bin LC_ALL=C.UTF-8 /usr/bin/setpriv --reuid=1234 --regid=1234 --clear-groups \
    sh -c "cd /tmp/user && $1"
}
begin=$SECONDS
as_user "python3 -m venv venv && venv/bin/pip install -q ./$(basename "$wheel")"
as_user 'venv/bin/turbidock run pool_active --json --quiet' >"$folder/wheel.json"
echo "installed and docked in $((SECONDS - begin)) s"
grep -q '"outcome": "success"' "$folder/wheel.json"
as_user "venv/bin/python -c 'import turbidock; print(turbidock.run(\"pool_active\").digest)'" >"$folder/wheel.digest"
grep -qF "\"digest\": \"$(cat "$folder/wheel.digest")\"" "$folder/wheel.json"
