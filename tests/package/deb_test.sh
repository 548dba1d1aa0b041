#!/usr/bin/env bash
# deb_test.sh PACKAGE.deb FOLDER: lintian has nothing to say, and in a bare Debian 12 below FOLDER the package installs
# with what it depends on alone, an ordinary user runs it, and it goes without a trace. As root; some minutes.
set -euo pipefail
package=$(realpath "$1")
folder=$(realpath -m "$2")
root=$folder/root

lintian --fail-on error,warning --allow-root "$package"

bash "$(dirname "$0")/bare_root.sh" "$root"
cp "$package" "$root/tmp/turbidock.deb"
inside() {
  unshare --mount --pid --fork --mount-proc="$root/proc" chroot "$root" \
    /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp \
    LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"
}
apt_get() { inside apt-get -o Dpkg::Use-Pty=0 -y -q "$@" >/dev/null; }

apt_get update
apt_get install --no-install-recommends /tmp/turbidock.deb
inside id diver >/dev/null 2>&1 || inside useradd --create-home diver
as_user() { inside setpriv --reuid=diver --regid=diver --clear-groups "$@"; }
as_user turbidock --version
as_user turbidock list
trial=(turbidock run pool_active --set trial.duration_s=1 --seed 1 --json --quiet)
as_user "${trial[@]}" >"$folder/inside.json"
rm -f "$root"/tmp/smoke.*
as_user turbidock batch smoke --seeds 1 --set estimator.pose_source=true_pose --set trial.duration_s=2 --out /tmp/smoke.db --quiet
test -s "$root/usr/share/man/man1/turbidock.1.gz"
as_user bash -c '. /usr/share/bash-completion/completions/turbidock; complete -p turbidock' >/dev/null
apt_get purge turbidock
if [ -n "$(find "$root/usr" "$root/etc" -name '*turbidock*' -print -quit)" ]; then
  echo "purging leaves something behind"
  exit 1
fi

# unpacked anywhere it works as well, and the same trial comes out
rm -rf "$folder/elsewhere"
dpkg-deb -x "$package" "$folder/elsewhere"
"$folder/elsewhere/usr/bin/${trial[0]}" "${trial[@]:1}" >"$folder/elsewhere.json"
cmp <(grep '"digest"' "$folder/inside.json") <(grep '"digest"' "$folder/elsewhere.json")
echo "the package installs, works for an ordinary user and goes without a trace"
