#!/usr/bin/env bash
# wheel_test.sh WHEEL FOLDER [SUITE|PYTHON]: an ordinary user of a bare Debian 12, or of another suite, below FOLDER with Python
# alone installs the wheel and docks, from the command line, from Python and with a ROS 2 node. As root, where the Python index
# can be reached. With the path of a Python: in a venv of it on this machine.
set -euo pipefail
wheel=$(realpath "$1")
folder=$(realpath -m "$2")
suite=${3:-bookworm}
name=$(basename "$wheel")
node=$(realpath "$(dirname "$0")")/../../experiments/python/examples/ros/controller_node.py
if [ -x "$suite" ]; then
  python=$suite
  user=$folder/venv-$("$python" -c 'import sys; print("{}.{}".format(*sys.version_info))')
  rm -rf "$user"
  mkdir -p "$user"
  as_user() {
    env -i HOME="$user" PATH=/usr/bin:/bin LC_ALL=C.UTF-8 TMPDIR=/tmp sh -c "cd '$user' && $1"
  }
else
  python=python3
  root=$folder/python-$suite
  user=$root/tmp/user
  bash "$(dirname "$0")/bare_root.sh" "$root" "$suite"
  chroot "$root" sh -c 'apt-get update -q && DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -q --no-install-recommends python3-venv' >"$folder/python.log"
  rm -rf "$user"
  install -d -o 1234 -g 1234 "$user"
  as_user() {
    unshare --mount --pid --fork --mount-proc="$root/proc" chroot "$root" /usr/bin/env -i HOME=/tmp/user PATH=/usr/bin:/bin \
      LC_ALL=C.UTF-8 /usr/bin/setpriv --reuid=1234 --regid=1234 --clear-groups sh -c "cd /tmp/user && $1"
  }
fi
cp "$wheel" "$node" "$user"
begin=$SECONDS
as_user "$python -m venv venv && venv/bin/pip install -q ./$name"
as_user 'venv/bin/turbidock run pool_active --json --quiet' >"$folder/wheel.json"
echo "installed and docked in $((SECONDS - begin)) s"
grep -q '"outcome": "success"' "$folder/wheel.json"
as_user "venv/bin/python -c 'import turbidock; print(turbidock.run(\"pool_active\").digest)'" >"$folder/wheel.digest"
grep -qF "\"digest\": \"$(cat "$folder/wheel.digest")\"" "$folder/wheel.json"
begin=$SECONDS
as_user "venv/bin/pip install -q './$name[ros]'"
as_user 'venv/bin/turbidock-ros run pool_active --answer wrench --expect success --quiet \
  --launch "exec venv/bin/python controller_node.py"'
echo "docked by a node in $((SECONDS - begin)) s"
# another Python
if as_user "venv/bin/pip install --no-deps --target other --only-binary :all: --python-version 3.8 ./$name" 2>"$folder/other.log"; then
  echo 'installed for Python 3.8'
  exit 1
fi
grep -q "$name is not a supported wheel on this platform" "$folder/other.log"
