#!/usr/bin/env bash
# Measures links between two components in C, in C++ and in Rust, alternately in one run:
#   sdk/c/measure.sh [ROUNDS]
# The first component is on core 0, the second on core 1. Prints each figure of each round, and at the end
# the medians, and those of the ratios to Rust within a round. A round has 20,000 round trips of 100 B for each
# size of an image, and 2,000 of images; the first 200 of each are not counted.

set -euo pipefail
cd "$(dirname "$0")/../.."
rounds="${1:-5}"
out="$(mktemp -d)"
run=
trap '[ -z "$run" ] || kill -INT "$run" 2>/dev/null; wait; rm -rf "$out"' EXIT

sdk/c/install.sh "$out/prefix" >"$out/log" 2>&1 || { cat "$out/log"; exit 1; }
# Apart from each other: what cargo builds together shares the features of all.
for part in "-p armor" "-p armor-c --example rust_peer"; do
  cargo build --release --locked $part >"$out/log" 2>&1 || { cat "$out/log"; exit 1; }
done
cmake -S sdk/c/tests/peers -B "$out/build" -DCMAKE_PREFIX_PATH="$out/prefix" >"$out/log"
cmake --build "$out/build" >"$out/log" 2>&1 || { cat "$out/log"; exit 1; }
mkdir "$out/components"
cp "$out/build/c_peer" "$out/build/cpp_peer" target/release/examples/rust_peer "$out/components/"

# The second tick, after a second, begins the measurement: the links are up.
measure() { # LANGUAGE FIRST-ROLE SECOND-ROLE LAST-LINE IMAGE-BYTES
  cat >"$out/system.xml" <<XML
<armor version="1">
  <system name="peers">
    <component name="first" kind="$1-peer" rate="1Hz" cpus="0">
      <parameter name="role" value="$2"/><parameter name="image" value="$5"/>
    </component>
    <component name="second" kind="$1-peer" rate="20Hz" cpus="1"><parameter name="role" value="$3"/></component>
    <link from="first.small-out" to="second.small-in" keep="all"/>
    <link from="first.image-out" to="second.image-in"/>
    <link from="second.small-out" to="first.small-in" keep="all"/>
    <link from="second.image-out" to="first.image-in"/>
  </system>
</armor>
XML
  rm -rf "$out/run"
  target/release/armor run "$out/system.xml" --components "$out/components" --headless --out "$out/run" \
    --system peers-measure >"$out/run.log" 2>&1 &
  run=$!
  for _ in $(seq 600); do
    if grep -q "$4" "$out/run.log"; then break; fi
    kill -0 "$run" 2>/dev/null || { cat "$out/run.log"; exit 1; }
    sleep 0.1
  done
  kill -INT "$run"
  wait "$run" || true
  run=
  sed -n "s/.*measured: \(.*\(us p99\|msg\/s\)\)$/$1 | \1/p" "$out/run.log"
}
# Each round begins with another language: what the machine does meanwhile meets all of them.
orders=("rust c cpp" "c cpp rust" "cpp rust c")
for round in $(seq "$rounds"); do
  for language in ${orders[$((round % 3))]}; do
    for image in 65536 1048576 8388608; do
      measure "$language" ask answer "measured: end" "$image"
    done
    measure "$language" flood count "measured: flood" 1
  done
done | tee "$out/figures"

python3 - "$out/figures" <<'PYTHON'
import re, statistics, sys

figures = {}
for line in open(sys.argv[1]):
    language, text = line.rstrip().split(" | ")
    what, values = text.split(": ", 1)
    for value, unit in re.findall(r"([\d.]+) (us p50|us p99|M msg/s)", values):
        figures.setdefault(f"{what}, {unit}", {}).setdefault(language, []).append(float(value))
print("\n| | Rust | C | C++ | C / Rust | C++ / Rust |\n| --- | ---: | ---: | ---: | ---: | ---: |")
for what, of in figures.items():
    # A round trip of 100 B is measured once for each size of an image.
    medians = [statistics.median(of[language]) for language in ("rust", "c", "cpp")]
    ratios = [statistics.median(a / b for a, b in zip(of[language], of["rust"])) for language in ("c", "cpp")]
    print(f"| {what} | " + " | ".join(f"{value:.4g}" for value in medians + ratios) + " |")
PYTHON
