#!/usr/bin/env bash
# Measures links between two components in C, in C++ and in Rust, alternately in one run:
#   sdk/c/measure.sh [ROUNDS]
# The first component is on core 0, the second on core 1. In a round each language has new processes, in
# each of the six orders in turn: 5,000 round trips of 100 B and 1,000 of each size of an image, of which the
# first 100 each are not counted, and a flood of 2,000,000 messages. Prints each figure of each round, and at
# the end the medians, and the median of the ratios to Rust within a round with its interval of 95 %.

set -euo pipefail
cd "$(dirname "$0")/../.."
rounds="${1:-31}"
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

# The second tick begins the measurement: the links are up.
measure() { # LANGUAGE FIRST-ROLE SECOND-ROLE LAST-LINE
  cat >"$out/system.xml" <<XML
<armor version="1">
  <system name="peers">
    <component name="first" kind="$1-peer" rate="2Hz" cpus="0"><parameter name="role" value="$2"/></component>
    <component name="second" kind="$1-peer" rate="2Hz" cpus="1"><parameter name="role" value="$3"/></component>
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
    kill -0 "$run" 2>/dev/null || break
    sleep 0.1
  done
  grep -q "$4" "$out/run.log" || { cat "$out/run.log" >&2; echo "$1: the measurement did not end" >&2; exit 1; }
  kill -INT "$run"
  wait "$run" || true
  run=
  sed -n "s/.*measured: \(.*\(us p99\|msg\/s\)\)$/$1 | \1/p" "$out/run.log"
}
# What the machine does meanwhile meets all languages.
orders=("rust c cpp" "cpp c rust" "c cpp rust" "rust cpp c" "cpp rust c" "c rust cpp")
for round in $(seq "$rounds"); do
  for language in ${orders[$((round % 6))]}; do
    measure "$language" ask answer "measured: end"
    measure "$language" flood count "measured: flood"
  done
done | tee "$out/figures"

python3 - "$out/figures" <<'PYTHON'
import math, re, statistics, sys


def find_interval(values):
    """The narrowest pair of values, equally far from both ends, between which the median lies at 95 %."""
    count, chance, rank = len(values), 0.0, 0
    while chance + math.comb(count, rank) / 2**count <= 0.025:
        chance += math.comb(count, rank) / 2**count
        rank += 1
    values = sorted(values)
    # With fewer than six rounds no interval has so much.
    return (values[rank - 1], values[count - rank]) if rank > 0 else (-math.inf, math.inf)


figures = {}
for line in open(sys.argv[1]):
    language, text = line.rstrip().split(" | ")
    what, values = text.split(": ", 1)
    for value, unit in re.findall(r"([\d.]+) (us p50|us p99|M msg/s)", values):
        figures.setdefault(f"{what}, {unit}", {}).setdefault(language, []).append(float(value))
print("\n| | Rust | C | C++ | C / Rust | C++ / Rust |\n| --- | ---: | ---: | ---: | ---: | ---: |")
for what, of in figures.items():
    cells = [f"{statistics.median(of[language]):.4g}" for language in ("rust", "c", "cpp")]
    for language in ("c", "cpp"):
        ratios = [other / rust for other, rust in zip(of[language], of["rust"])]
        # Times per message, so that less is better in each row.
        ratios = [1 / ratio for ratio in ratios] if what.endswith("msg/s") else ratios
        low, high = find_interval(ratios)
        median = statistics.median(ratios)
        verdict = "met" if median <= 1.05 else "**missed**" if low > 1.05 else "open"
        cells.append(f"{median:.3f} ({low:.3f} to {high:.3f}): {verdict}")
    print(f"| {what} | " + " | ".join(cells) + " |")
print("\nmet: the median is at most 1.05; missed: the whole interval is above; open: the median alone is above.")
print("Of the flood, the ratio is that of the time per message.")
PYTHON
echo "$rounds rounds in $SECONDS s"
