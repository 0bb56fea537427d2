#!/usr/bin/env bash
# Compares the encoder's settings on one clip, pair by pair in turns, so that a busy machine hits both alike.
#
#   scripts/bench.sh clip.y4m [FRAMES [OPTION...]]       OPTIONs as of examples/measure.rs, e.g. --simplification-ratio 0.02
#   scripts/bench.sh "frames/*.png" 24
set -euo pipefail
if [ $# -eq 0 ]; then
    sed -n '2,6s/^# \{0,1\}//p' "$0"
    exit 2
fi
mapfile -t files < <(compgen -G "$1" | sort | xargs -d '\n' realpath)
frames=${2:-24}
shift $(($# < 2 ? $# : 2))
cd "$(dirname "$0")/.."
cargo build --locked --release --quiet --example measure
measure=${CARGO_TARGET_DIR:-target}/release/examples/measure

run() { "$measure" "${files[@]}" --frames "$frames" "$@"; }

# pair NAME OPTIONS... -- OPTIONS...: three turns of both, the ratio of their fastest times.
pair() {
    local name=$1 first=() second=()
    shift
    while [ "$1" != -- ]; do
        first+=("$1")
        shift
    done
    shift
    second=("$@")
    local best=(1e9 1e9) line n
    for _ in 1 2 3; do
        for n in 0 1; do
            if [ "$n" = 0 ]; then line=$(run "${first[@]}"); else line=$(run "${second[@]}"); fi
            best[n]=$(awk -v a="${best[$n]}" -v b="$(awk "{ print \$2 + 0 }" <<<"$line")" 'BEGIN { print (b < a ? b : a) }')
        done
    done
    awk -v name="$name" -v a="${best[0]}" -v b="${best[1]}" \
        'BEGIN { printf "%-36s %.3f s/frame against %.3f: %.2f times\n", name, a, b, a / b }'
}

for preset in fast medium slow; do
    printf '%-8s' "$preset"
    run --preset "$preset" "$@"
done
pair "one thread against two" --threads 1 "$@" -- --threads 2 "$@"
pair "medium against fast" --preset medium "$@" -- --preset fast "$@"
pair "dense lattice against adaptive" --lattice dense "$@" -- --lattice adaptive "$@"
