#!/usr/bin/env bash
# Regenerates the pictures of docs/images, each by running what it shows:
#   docs/pictures.sh            those in simulation (about six minutes)
#   ARMOR_DATA=DIR docs/pictures.sh   also those of recorded logs; DIR holds laser/
set -euo pipefail
cd "$(dirname "$0")/.."

out="$(mktemp -d)"
trap 'rm -rf "$out"' EXIT
images="$PWD/docs/images"
cargo build --release --locked -p armor -p armor-operator-view
programs="${CARGO_TARGET_DIR:-target}/release"
armor="$programs/armor"

map_of() { # MISSION PICTURE [arguments of armor run]
  local mission="$1" picture="$2"
  shift 2
  echo "== $picture"
  "$armor" run "missions/$mission.xml" --headless --out "$out/$picture" "$@"
  cp "$out/$picture/map.png" "$images/$picture.png"
}

map_of office office-map
map_of patrol patrol-map
map_of explore-and-map explore-and-map
echo "== symbols"
cargo run --locked -p armor-symbols --example sheet -- "$images/symbols.png"
echo "== operator-view"
# Half-way through the office: what the operator sees is written when the run ends.
status=0
"$armor" run missions/operator.xml --headless --for 60s --out "$out/operator" \
  --set view.picture=view.png || status=$?
[ "$status" -le 1 ]
cp "$out/operator/view.png" "$images/operator-view.png"

if [ -n "${ARMOR_DATA:-}" ]; then
  for log in intel aces freiburg-079 acapulco; do
    map_of map-from-log "$log-map" --set "player.file=$ARMOR_DATA/laser/$log.log.gz"
  done
  "$armor" eval "$out/aces-map/trajectory.csv" --plot "$images/aces-errors.svg" \
    --relations "$ARMOR_DATA/laser/aces.relations.csv" \
    --reference "$ARMOR_DATA/laser/aces.reference.csv"

  cargo run --release --locked -p armor-carmen-player --example mines -- \
    "$ARMOR_DATA/laser/mines-exp2.dat.gz" >"$out/mines.log"
  map_of map-from-log mines-map --set "player.file=$out/mines.log"

  mkdir "$out/curves"
  ARMOR_PARTICLES=30 ARMOR_MAPS="$out/curves" cargo test --locked -p armor-grid-slam --test logs -- \
    --test-threads 1
  for log in intel aces freiburg-079 edmonton acapulco; do
    cut -d, -f1,3,4 "$out/curves/$log.curve.csv" >"$out/curve.csv"
    "$armor" eval --curve "$out/curve.csv" --plot "$images/$log-curve.png"
  done
fi
