#!/usr/bin/env bash
# tarball_test.sh TARBALL FOLDER: unpacked in a bare Debian 12 and in a bare Debian 13 below FOLDER, where nothing else is
# installed, an ordinary user's trials come out as they do here. As root; some minutes.
set -euo pipefail
tarball=$(realpath "$1")
folder=$(realpath -m "$2")
mkdir -p "$folder"
trial=(run pool_active --set trial.duration_s=1 --seed 1 --json --quiet)

rm -rf "$folder/here"
mkdir -p "$folder/here"
tar -C "$folder/here" --strip-components=1 -xf "$tarball"
"$folder/here/bin/turbidock" "${trial[@]}" >"$folder/here.json"

for suite in bookworm trixie; do
  root=$folder/$suite
  bash "$(dirname "$0")/bare_root.sh" "$root" "$suite"
  rm -rf "$root/opt/ü mlaut"
  mkdir -p "$root/opt/ü mlaut"
  tar -C "$root/opt/ü mlaut" --strip-components=1 -xf "$tarball"
  as_user() {
    unshare --mount --pid --net --fork --mount-proc="$root/proc" chroot "$root" \
      /usr/bin/env -i HOME=/tmp LC_ALL=C.UTF-8 /usr/bin/setpriv --reuid=1234 --regid=1234 --clear-groups "$@"
  }
  program='/opt/ü mlaut/bin/turbidock'
  as_user "$program" --version
  as_user "$program" "${trial[@]}" >"$folder/$suite.json"
  cmp <(grep '"digest"' "$folder/here.json") <(grep '"digest"' "$folder/$suite.json")
  rm -f "$root"/tmp/smoke.*
  as_user "$program" batch smoke --seeds 1 --out /tmp/smoke.db --quiet >/dev/null
  as_user "$program" status /tmp/smoke.db
done
echo "the tarball runs where nothing else is installed, in Debian 12 and 13"
