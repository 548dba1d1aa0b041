#!/usr/bin/env bash
# run.sh BUILD SECONDS: every fuzzer of a build for so long, from the committed corpus; what they find
# stays in BUILD/corpus. Ends with 1 at the first input that does harm, which is named.
set -euo pipefail
build=$1 seconds=$2
here=$(dirname "$0")
for fuzzer in "$build"/bin/fuzz_*; do
  name=${fuzzer##*/fuzz_}
  found=$build/corpus/$name
  mkdir -p "$found" "$build/harm"
  echo "== $name, $seconds s"
  if ! "$fuzzer" -dict="$here/dictionary.txt" -max_total_time="$seconds" -timeout=10 \
    -rss_limit_mb=1024 -max_len=65536 -print_final_stats=1 -artifact_prefix="$build/harm/$name-" \
    "$found" "$here/corpus/$name" >"$build/corpus/$name.log" 2>&1; then
    tail -40 "$build/corpus/$name.log"
    exit 1
  fi
  grep -E 'number_of_executed_units|average_exec_per_sec|peak_rss' "$build/corpus/$name.log"
done
