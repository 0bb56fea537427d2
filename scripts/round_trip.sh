#!/usr/bin/env bash
# Loads the plugin in DIRECTORY with GStreamer's own tools and sends a small clip through it and back at another size.
#
#   scripts/round_trip.sh DIRECTORY
set -euo pipefail

directory=${1:?"usage: round_trip.sh DIRECTORY"}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# A registry of our own: a plugin that failed once stays on the black list of the user's.
export GST_PLUGIN_PATH=$directory GST_REGISTRY=$work/registry.bin
# gst-launch keeps a crashed process alive unless told not to.
launch() { timeout 120 gst-launch-1.0 -f -q "$@"; }

for element in tetvecenc tetvecdec tetvecparse; do
    timeout 60 gst-inspect-1.0 "$element" >/dev/null
done

frames=12
launch videotestsrc pattern=ball num-buffers=$frames ! video/x-raw,width=48,height=32,framerate=24/1 \
    ! tetvecenc key-int-max=6 ! filesink location="$work/clip.tetv"
launch filesrc location="$work/clip.tetv" ! tetvecparse ! tetvecdec \
    ! video/x-raw,format=RGBx,width=96,height=64 ! filesink location="$work/clip.rgbx"

expected=$((frames * 96 * 64 * 4))
found=$(wc -c <"$work/clip.rgbx")
if [ "$found" -ne "$expected" ]; then
    echo "round trip: expected $expected bytes of pictures, found $found" >&2
    exit 1
fi
echo "round trip: $frames frames, $(wc -c <"$work/clip.tetv") bytes"
