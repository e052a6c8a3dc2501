#!/usr/bin/env bash
# Writes golden.csv, the values that `cargo test -p armor-geo golden` compares with: positions as
# GeographicLib converts them (Debian: geographiclib-tools).
set -euo pipefail
cd "$(dirname "$0")"

# Latitude, longitude, height; the last eight are at poles and edges.
positions="48.8583 2.2945 35
48.85857 2.2946 40.5
49.5 3.2 120
-33.8568 151.2153 5
-34.4 150.9 800
60.39 5.32 12
63.9999 3.0001 0
56.0 3.0 0
71.9999 8.9999 10
72.0 8.9999 10
78.22 15.63 30
78.22 20.9999 30
78.22 21.0 30
78.22 33.0 30
83.9 42.0 0
0.0 0.0 0
0.0 -180.0 0
-0.0001 179.9999 -300
-79.9 -60.1 2000
1.3 103.8 15
35.0 -120.0 -50
35.0 -117.0 8848
64.1 -21.9 20
-54.8 -68.3 57
45.0 6.0 4810
45.0 11.999999 100
10.0 -3.0 12000
10.0 -0.0001 400000"
poles="90 0 0
90 120 5000
-90 0 -100
89.9999999 45 10
-89.99 -179 3000
84.5 10 0
-80.5 170 100
85.06 0 0"

origin_of() { awk '{ printf "%.1f %.1f 50\n", $1 * 0.995, $2 + 0.1 }' <<<"$1"; }

{
  echo "# $(CartConvert --version | sed 's|.*/||'); written by golden.sh"
  echo "# latitude,longitude,height,x,y,z,origin latitude,longitude,height,east,north,up,zone,easting,northing,convergence,scale"
  while read -r position; do
    ecef=$(CartConvert -p 9 <<<"$position")
    origin=$(origin_of "$position")
    # shellcheck disable=SC2086
    local=$(CartConvert -l $origin -p 9 <<<"$position")
    grid=$(cut -d' ' -f1,2 <<<"$position" | GeoConvert -u -p 9)
    bend=$(cut -d' ' -f1,2 <<<"$position" | GeoConvert -c -p 9)
    case "$grid" in [0-9]*) ;; *) grid="- - -" bend="- -" ;; esac
    echo "$position $ecef $origin $local $grid $bend" | tr ' ' ','
  done < <(printf '%s\n%s\n' "$positions" "$poles")
} >golden.csv
