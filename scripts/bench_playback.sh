#!/usr/bin/env bash
# Frames a second of playback beside avdec_h264 and videoscale (Lanczos) on the same clip, in turns, as a table.
#
#   scripts/bench_playback.sh "frames/*.png" [OPTION...]     OPTIONs as of examples/vectorize.rs
#
# Both play the clip four times in a row to a sink without a clock, in I420, at the same size, on all cores; a figure is
# the best of three turns, without the start of the pipeline. SIZES="640x360 1920x1080" measures others than the default.
set -euo pipefail
if [ $# -eq 0 ]; then
    sed -n '2,7s/^# \{0,1\}//p' "$0"
    exit 2
fi
mapfile -t files < <(compgen -G "$1" | sort | xargs -d '\n' realpath)
shift
cd "$(dirname "$0")/.."
# shellcheck source=scripts/packages.sh
source scripts/packages.sh
install_missing gstreamer1.0-libav ffmpeg
cargo build --locked --release --quiet --example vectorize
cargo build --locked --release --quiet -p gst-plugin-tetvec
target=$(realpath "${CARGO_TARGET_DIR:-target}")/release
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export GST_PLUGIN_PATH=$target GST_REGISTRY=$work/registry.bin

"$target/examples/vectorize" "${files[@]}" "$work/one.tetv" "$@" | tail -n 1
printf "file '%s'\nduration 0.04\n" "${files[@]}" >"$work/list"
ffmpeg -v error -f concat -safe 0 -i "$work/list" -r 25 -c:v libx264 -pix_fmt yuv420p "$work/one.h264"
for kind in tetv h264; do
    for _ in 1 2 3 4; do cat "$work/one.$kind"; done >"$work/four.$kind"
done
frames=$((4 * ${#files[@]}))

# seconds ELEMENTS...: how long the pipeline played.
seconds() {
    timeout 120 gst-launch-1.0 -f filesrc "$@" ! fakesink sync=false |
        sed -n 's/^Execution ended after 0:\([0-9]*\):\([0-9.]*\)$/\1 \2/p' | awk '{ print 60 * $1 + $2 }'
}

printf '| size | tetvecdec | avdec_h264 ! videoscale | ratio |\n|---|---|---|---|\n'
for size in ${SIZES:-640x360 1920x1080 3840x2160}; do
    caps=video/x-raw,format=I420,width=${size%x*},height=${size#*x}
    best=(1e9 1e9)
    for _ in 1 2 3; do
        mine=$(seconds location="$work/four.tetv" ! tetvecparse ! tetvecdec ! "$caps")
        theirs=$(seconds location="$work/four.h264" ! h264parse ! avdec_h264 ! queue ! \
            videoscale method=lanczos n-threads="$(nproc)" ! "$caps")
        best[0]=$(awk -v a="${best[0]}" -v b="$mine" 'BEGIN { print (b < a ? b : a) }')
        best[1]=$(awk -v a="${best[1]}" -v b="$theirs" 'BEGIN { print (b < a ? b : a) }')
    done
    awk -v size="$size" -v n="$frames" -v a="${best[0]}" -v b="${best[1]}" \
        'BEGIN { printf "| %s | %.1f | %.1f | %.2f |\n", size, n / a, n / b, b / a }'
done
