#!/bin/sh
# The clock of the host jumps an hour ahead, two back and one ahead while the office mission runs: the
# calls of components, the time of the mission and the processor time of all processes, each 8 s.
#   sudo bench/clock-jumps.sh [ARMOR]
# The clock itself is not touched. A library shifts CLOCK_REALTIME for the processes of a mount
# namespace, in which /etc/ld.so.preload names it. It needs root and a C compiler.
set -eu
armor=${1:-target/release/armor}
armor=$(realpath "$armor")
missions=$(cd "$(dirname "$0")/../missions" && pwd)
if [ -z "${CLOCK_JUMPS:-}" ]; then
    CLOCK_JUMPS=$(mktemp -d)
    export CLOCK_JUMPS
    trap 'rm -rf "$CLOCK_JUMPS"' EXIT
    unshare --mount "$0" "$armor"
    exit
fi
cd "$CLOCK_JUMPS"
cat > shift.c <<C
#include <fcntl.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>
static long offset_s(void) {
    char text[32] = {0};
    int file = open("$CLOCK_JUMPS/offset", O_RDONLY | O_CLOEXEC);
    if (file < 0) return 0;
    ssize_t len = read(file, text, sizeof text - 1);
    close(file);
    return len > 0 ? atol(text) : 0;
}
int clock_gettime(clockid_t clock, struct timespec *now) {
    int failed = syscall(SYS_clock_gettime, clock, now);
    if (!failed && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) now->tv_sec += offset_s();
    return failed;
}
int gettimeofday(struct timeval *restrict now, void *restrict zone) {
    struct timespec time;
    (void)zone;
    clock_gettime(CLOCK_REALTIME, &time);
    now->tv_sec = time.tv_sec;
    now->tv_usec = time.tv_nsec / 1000;
    return 0;
}
time_t time(time_t *now) {
    struct timespec time;
    clock_gettime(CLOCK_REALTIME, &time);
    if (now) *now = time.tv_sec;
    return time.tv_sec;
}
C
cc -O1 -shared -fPIC -o shift.so shift.c
mkdir runtime upper
chmod 700 runtime
export XDG_RUNTIME_DIR="$CLOCK_JUMPS/runtime"
mount -t tmpfs none upper
mkdir upper/upper upper/work
mount -t overlay overlay -o "lowerdir=/etc,upperdir=upper/upper,workdir=upper/work" /etc
echo "$CLOCK_JUMPS/shift.so" > /etc/ld.so.preload
echo 0 > offset
"$armor" run "$missions/office.xml" --headless --quiet --out out > run.log 2>&1 &
run=$!
trap 'kill -INT $run 2>/dev/null; wait $run || true; umount /etc upper' EXIT
ticks() {
    for pid in $(cat "/proc/$run/task/$run/children") $run; do cat "/proc/$pid/stat"; done 2>/dev/null |
        sed 's/.*) //' | awk '{ sum += $12 + $13 } END { print sum }'
}
# The column CALLS of `armor ps` is in the JSON of each process as exec_calls.
calls() {
    "$armor" ps --format json | grep "\"name\":\"$1\"" | grep -o '"exec_calls":[0-9]*' | cut -d: -f2 | head -n 1
}
sleep 10
printf '%-7s  %-20s  %-9s  %-6s  %s\n' OFFSET DATE SIMULATOR MAPPER 'PROCESSOR (10 ms)'
for offset in 0 3600 -3600 0; do
    echo "$offset" > offset
    date=$(date -u +%Y-%m-%dT%H:%M:%SZ)
    ticks=$(ticks) simulator=$(calls simulator) mapper=$(calls mapper)
    sleep 8
    printf '%-7s  %-20s  %-9s  %-6s  %s\n' "$offset" "$date" $(($(calls simulator) - simulator)) \
        $(($(calls mapper) - mapper)) $(($(ticks) - ticks))
done
"$armor" mission show | head -n 1
grep -E 'WARN|ERROR' run.log || echo 'no warning'
