#!/usr/bin/env bash
# Memory of components in C and C++: resident memory while messages pass, the same with the address and
# undefined-behaviour sanitizers, and the package's own tests under valgrind (Debian: valgrind).
#   sdk/c/memory.sh [MESSAGES] [PATH OF THE PROGRAM armor]
set -euo pipefail
cd "$(dirname "$0")/../.."
messages="${1:-10000000}"
armor="$(realpath "${2:-target/release/armor}")"
command -v valgrind >/dev/null || { echo "$0: valgrind is missing; apt-get install valgrind" >&2; exit 1; }
out="$(mktemp -d)"
run=
trap '[ -z "$run" ] || kill -INT "$run" 2>/dev/null; wait; rm -rf "$out"' EXIT
quietly() { "$@" >"$out/log" 2>&1 || { cat "$out/log"; exit 1; }; }

quietly sdk/c/install.sh "$out/prefix"
for sanitize in OFF ON; do
  quietly cmake -S sdk/c/tests/peers -B "$out/$sanitize" -DCMAKE_PREFIX_PATH="$out/prefix" -DSANITIZE=$sanitize
  quietly cmake --build "$out/$sanitize"
done

# One component sends, one counts and logs its memory ten times; the sanitizers end one that is wrong.
flood() { # LANGUAGE SANITIZE
  rm -rf "$out/components" "$out/run"
  mkdir "$out/components"
  cp "$out/$2/$1_peer" "$out/components/"
  cat >"$out/system.xml" <<XML
<armor version="1">
  <system name="memory">
    <component name="first" kind="$1-peer" rate="1Hz" restart="never">
      <parameter name="role" value="flood"/>
      <parameter name="flood" value="$messages"/>
    </component>
    <component name="second" kind="$1-peer" rate="20Hz" restart="never">
      <parameter name="role" value="count"/>
      <parameter name="flood" value="$messages"/>
    </component>
    <link from="first.small-out" to="second.small-in" keep="all"/>
  </system>
</armor>
XML
  "$armor" run "$out/system.xml" --components "$out/components" --headless --out "$out/run" \
    --system peers-memory >"$out/run.log" 2>&1 &
  run=$!
  until grep -q "measured: flood" "$out/run.log"; do
    kill -0 "$run" 2>/dev/null || { cat "$out/run.log"; exit 1; }
    sleep 0.2
  done
  kill -INT "$run"
  wait "$run" || true
  run=
  # Leaks are found at the end of a process.
  if grep -E 'Sanitizer|runtime error' "$out"/run/logs/*.log; then exit 1; fi
  sed -n "s/.*measured: \(.* resident\)/$1 | sanitizers $2 | \1/p" "$out/run.log"
}
for language in c cpp; do
  for sanitize in OFF ON; do
    flood $language $sanitize
  done
done

quietly cmake -S sdk/c/tests/native -B "$out/native" -DCMAKE_PREFIX_PATH="$out/prefix"
quietly cmake --build "$out/native" --parallel 2
for test in "$out"/native/*_test_*; do
  valgrind --quiet --leak-check=full --errors-for-leak-kinds=definite,indirect --error-exitcode=1 "$test"
  echo "valgrind | $(basename "$test"): no errors, no leaks"
done
