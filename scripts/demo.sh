#!/usr/bin/env bash
# Vectorizes a clip through GStreamer and draws it enlarged. Installs missing packages on Debian.
#
#   scripts/demo.sh [VIDEO]
#
# Without VIDEO a small clip is made. Of a longer video the first FRAMES frames are taken (default 50). Results are
# written to OUTPUT (default target/demo).
set -euo pipefail
video=${1:+$(realpath "$1")}
cd "$(dirname "$0")/.."
# shellcheck source=scripts/packages.sh
source scripts/packages.sh

frames=${FRAMES:-50}
output=${OUTPUT:-target/demo}
# How much larger the pictures are drawn than the clip is.
zoom=4

install_missing "${packages[@]}"
if [ -n "$video" ]; then
    install_missing gstreamer1.0-libav
fi
need_rust

echo "== Building"
cargo build --locked --release -p gst-plugin-tetvec --lib
cargo build --locked --release --example render --example figure
target=$(cargo metadata --locked --format-version 1 --no-deps | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')

mkdir -p "$output"
output=$(realpath "$output")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# The plugin as it was built just now, and a registry of our own beside the user's.
export GST_PLUGIN_PATH=$target/release GST_REGISTRY=$work/registry.bin
# gst-launch keeps a crashed process alive unless told not to.
launch() { gst-launch-1.0 -f "$@"; }

if [ -n "$video" ]; then
    echo "== Reading $video"
    launch -q filesrc location="$video" ! decodebin ! videoconvert ! video/x-raw,format=I420,colorimetry=bt601 \
        ! identity eos-after=$((frames + 1)) ! y4menc ! filesink location="$work/clip.y4m"
else
    echo "== Making a clip"
    launch -q videotestsrc pattern=ball background-color=0xff203060 foreground-color=0xffffc040 num-buffers="$frames" \
        ! video/x-raw,format=I420,width=160,height=120,framerate=25/1,colorimetry=bt601 \
        ! y4menc ! filesink location="$work/clip.y4m"
fi
read -r width height < <(head -n 1 "$work/clip.y4m" | sed 's/.* W\([0-9]*\) H\([0-9]*\) .*/\1 \2/')

echo "== Vectorizing $width x $height pixels"
stream=$output/clip.tetv
# At its end progressreport asks for a position that there is none of any more.
launch -q filesrc location="$work/clip.y4m" ! y4mdec ! progressreport name=encoded update-freq=5 do-query=false \
    ! tetvecenc ! filesink location="$stream" | sed '/Could not query/d'
gst-discoverer-1.0 "$stream" | grep -E 'Duration|video' || true

echo "== Playing it at $((zoom * width)) pixels width as fast as it goes"
time launch -q filesrc location="$stream" ! tetvecparse ! tetvecdec \
    ! "video/x-raw,width=$((zoom * width))" ! fakesink sync=false

echo "== Drawing"
"$target/release/examples/render" "$stream" "$work/all" --width 16 >/dev/null
taken=$(find "$work/all" -name '*.png' | wc -l)
middle=$((taken / 2))
"$target/release/examples/render" "$stream" "$output/enlarged.png" --time "$middle" --width $((zoom * width))
"$target/release/examples/figure" "$work/clip.y4m" "$stream" "$output/figure.png" --frame "$middle"

cat <<END

The vector stream:              $stream ($(wc -c <"$stream") bytes, $taken frames)
Frame $middle, $zoom times as wide:      $output/enlarged.png
Beside the original and Lanczos: $output/figure.png

Play it at any size:
  GST_PLUGIN_PATH=$target/release gst-play-1.0 $stream
END
