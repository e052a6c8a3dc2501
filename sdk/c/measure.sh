#!/usr/bin/env bash
# Measures links between two components in C, in C++ and in Rust, alternately in one run:
#   sdk/c/measure.sh [--one-core] [ROUNDS]
# The first component is on core 0, the second on core 1, or on core 0 as well: then no core has to wake
# up, and what a language adds is a larger part of each time. In a round each language has new processes, in
# each of the six orders in turn: 5,000 round trips of 100 B and 1,000 of each size of an image, of which the
# first 100 each are not counted, and a flood of 2,000,000 messages. Prints each figure of each round, and at
# the end for each the lower decile over the rounds, and its ratio to Rust with the interval of 95 %. What else
# uses the machine only adds to a time, and on a shared host for seconds, by a third: hence not the median.

set -euo pipefail
cd "$(dirname "$0")/../.."
second_core=1
if [ "${1:-}" = --one-core ]; then second_core=0; shift; fi
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
    <component name="second" kind="$1-peer" rate="2Hz" cpus="$second_core"><parameter name="role" value="$3"/></component>
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
import random, re, sys


def find_decile(times):
    times = sorted(times)
    at = (len(times) - 1) / 10
    low = int(at)
    return times[low] + (at - low) * (times[min(low + 1, len(times) - 1)] - times[low])


def find_interval(times, of_rust):
    """The bootstrap's interval of 95 % for the ratio of the deciles (Efron, Annals of Statistics 7, 1979)."""
    draw = random.Random(1).choices
    ratios = sorted(
        find_decile(draw(times, k=len(times))) / find_decile(draw(of_rust, k=len(of_rust)))
        for _ in range(4000)
    )
    return ratios[99], ratios[3899]


figures = {}
for line in open(sys.argv[1]):
    language, text = line.rstrip().split(" | ")
    what, values = text.split(": ", 1)
    for value, unit in re.findall(r"([\d.]+) (us p50|us p99|M msg/s)", values):
        # Of a flood the time per message, so that less is better in each row.
        time = 1000 / float(value) if unit == "M msg/s" else float(value)
        unit = "ns per message" if unit == "M msg/s" else unit
        figures.setdefault(f"{what}, {unit}", {}).setdefault(language, []).append(time)
print("\n| | Rust | C | C++ | C / Rust | C++ / Rust |\n| --- | ---: | ---: | ---: | ---: | ---: |")
for what, of in figures.items():
    deciles = {language: find_decile(times) for language, times in of.items()}
    cells = [f"{deciles[language]:.4g}" for language in ("rust", "c", "cpp")]
    for language in ("c", "cpp"):
        ratio = deciles[language] / deciles["rust"]
        low, high = find_interval(of[language], of["rust"])
        verdict = "met" if ratio <= 1.05 else "**missed**" if low > 1.05 else "open"
        cells.append(f"{ratio:.3f} ({low:.3f} to {high:.3f}): {verdict}")
    print(f"| {what} | " + " | ".join(cells) + " |")
print("\nmet: the ratio is at most 1.05; missed: the whole interval is above; open: the ratio alone is above.")
PYTHON
echo "$rounds rounds in $SECONDS s"
