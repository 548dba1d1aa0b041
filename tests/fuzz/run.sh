#!/usr/bin/env bash
# run.sh BUILD SECONDS [NAME...]: every fuzzer of a build (or those named) for so long, $JOBS at a time, from the
# committed corpus; what they find stays in BUILD/corpus. Fails when an input does harm, which is named. A build by
# AFL++'s compiler runs under afl-fuzz, any other is libFuzzer's own.
set -euo pipefail
build=$1 seconds=$2
shift 2
here=$(dirname "$0")
mkdir -p "$build/harm"

with_libfuzzer() {
  local fuzzer=$1 name=$2 found=$build/corpus/$2
  mkdir -p "$found"
  "$fuzzer" -dict="$here/dictionary.txt" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=1024 -max_len=65536 \
    -print_final_stats=1 -artifact_prefix="$build/harm/$name-" "$found" "$here/corpus/$name" \
    >"$build/corpus/$name.log" 2>&1 || return 1
  grep -E 'number_of_executed_units|average_exec_per_sec|peak_rss' "$build/corpus/$name.log"
}

with_afl() {
  local fuzzer=$1 name=$2 found=$build/corpus/$2
  AFL_AUTORESUME=1 AFL_NO_UI=1 AFL_NO_AFFINITY=1 AFL_SKIP_CPUFREQ=1 AFL_I_DONT_CARE_ABOUT_MISSING_CRASHES=1 \
    afl-fuzz -V "$seconds" -i "$here/corpus/$name" -o "$found" -x "$here/dictionary.txt" -m none -t 10000+ -- \
    "$fuzzer" >"$build/corpus/$name.log" 2>&1 || return 1
  grep -E '^(execs_done|execs_per_sec|edges_found)' "$found/default/fuzzer_stats"
  for harm in "$found"/default/crashes/id* "$found"/default/hangs/id*; do
    if [ ! -e "$harm" ]; then continue; fi
    cp "$harm" "$build/harm/$name-$(basename "$harm" | tr -c 'a-zA-Z0-9\n' _)"
    echo "$harm" >>"$build/corpus/$name.log"
    return 1
  done
}

engine=with_libfuzzer
if grep -q '^CMAKE_CXX_COMPILER:.*afl-' "$build/CMakeCache.txt"; then engine=with_afl; fi
mkdir -p "$build/corpus"
if [ $# -eq 1 ]; then
  if "$engine" "$build/bin/fuzz_$1" "$1" >"$build/corpus/$1.figures"; then
    printf '== %s, %s s\n%s\n' "$1" "$seconds" "$(cat "$build/corpus/$1.figures")"
    exit
  fi
  printf '== %s does harm\n%s\n' "$1" "$(tail -40 "$build/corpus/$1.log")"
  exit 1
fi
if [ $# -eq 0 ]; then
  for fuzzer in "$build"/bin/fuzz_*; do set -- "$@" "${fuzzer##*/fuzz_}"; done
fi
printf '%s\n' "$@" | xargs -P "${JOBS:-1}" -n 1 bash "$0" "$build" "$seconds"
