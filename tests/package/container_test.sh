#!/usr/bin/env bash
# container_test.sh PACKAGE.deb FOLDER: podman builds the image of Containerfile on a bare Debian 12, and an ordinary user
# runs a batch in it without a network. Images are kept below FOLDER. As root; some minutes.
set -euo pipefail
top=$(realpath "$(dirname "$0")/../..")
package=$(realpath "$1")
folder=$(realpath -m "$2")
mkdir -p "$folder/context" "$folder/work"
cp "$package" "$folder/context/"

# Works inside another container or a small virtual machine too: no overlay file system, limits that nobody has to raise, and
# runc, which takes any arrangement of control groups.
pod() {
  podman --root "$folder/images" --runroot "$folder/state" --storage-driver vfs --cgroup-manager cgroupfs \
    --runtime runc "$@"
}
limits=(--ulimit nofile=1024:1024 --ulimit nproc=4096:4096)

bash "$top/tests/package/bare_root.sh" "$folder/root"
tar -C "$folder/root" --exclude='./var/cache/apt/archives/*.deb' -c . | pod import - turbidock-base >/dev/null
if ! why=$(pod run --rm --network=none "${limits[@]}" turbidock-base true 2>&1); then
  echo "podman runs no container on this machine, so nothing was tested: $why"
  exit "${CONTAINER_REQUIRED:-0}"
fi
pod build --network=host "${limits[@]}" --build-arg BASE=localhost/turbidock-base -f "$top/Containerfile" \
  -t turbidock "$folder/context" >"$folder/build.log" 2>&1 || {
  tail -20 "$folder/build.log"
  exit 1
}
chmod 777 "$folder/work"
inside() { pod run --rm --network=none --read-only --tmpfs /tmp "${limits[@]}" -v "$folder/work:/work" "$@"; }

user=$(inside --entrypoint id turbidock -u)
if [ "$user" = 0 ]; then
  echo "the image runs as root"
  exit 1
fi
rm -f "$folder"/work/*
inside turbidock batch smoke --seeds 1 --out smoke.db --quiet >/dev/null
trial=(run pool_active --set trial.duration_s=1 --seed 1 --json --quiet)
inside turbidock "${trial[@]}" >"$folder/inside.json"
rm -rf "$folder/outside"
dpkg-deb -x "$package" "$folder/outside"
# The same trials come out in the container and beside it.
"$folder/outside/usr/bin/turbidock" "${trial[@]}" >"$folder/outside.json"
cmp <(grep '"digest"' "$folder/inside.json") <(grep '"digest"' "$folder/outside.json")
test "$(stat -c %u "$folder/work/smoke.db")" = "$user"
"$folder/outside/usr/bin/turbidock" status "$folder/work/smoke.db"
echo "the image builds, and user $user runs a batch in it without a network"
