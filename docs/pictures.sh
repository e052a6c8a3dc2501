#!/usr/bin/env bash
# Makes the pictures of docs/images anew, each by running what it shows:
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
echo "== operator-view"
# Half-way through the office: what the operator sees is written when the run ends.
status=0
"$armor" run missions/operator.xml --headless --for 60s --out "$out/operator" \
  --set view.picture=view.png || status=$?
[ "$status" -le 1 ]
cp "$out/operator/view.png" "$images/operator-view.png"

if [ -n "${ARMOR_DATA:-}" ]; then
  map_of map-from-log intel-map --set "player.file=$ARMOR_DATA/laser/intel.log.gz"
  map_of map-from-log aces-map --set "player.file=$ARMOR_DATA/laser/aces.log.gz"
  "$armor" eval "$out/aces-map/trajectory.csv" --plot "$images/aces-errors.svg" \
    --relations "$ARMOR_DATA/laser/aces.relations.csv" \
    --reference "$ARMOR_DATA/laser/aces.reference.csv"
fi
