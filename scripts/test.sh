#!/usr/bin/env bash
# Everything that must hold before a change goes in. Installs missing packages on Debian, takes some 20 minutes on two
# cores from a fresh clone.
#
#   scripts/test.sh
set -euo pipefail
cd "$(dirname "$0")/.."
# shellcheck source=scripts/packages.sh
source scripts/packages.sh

step() { printf '\n== %s (%d s)\n' "$1" "$SECONDS"; }

step "packages"
install_missing "${packages[@]}"
need_rust

# The tests' own registry: what they load is linked in.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export GST_REGISTRY=$work/registry.bin

step "format"
cargo fmt --all --check

# The core without its features is the decoder alone; the plugin needs both.
step "lints"
cargo clippy --locked --workspace --all-targets -- -D warnings
cargo clippy --locked --workspace --all-targets --all-features -- -D warnings
cargo clippy --locked -p tetvec --all-targets --no-default-features -- -D warnings

step "tests"
cargo test --locked --workspace --exclude gst-plugin-tetvec
# A warning of GStreamer or GLib is a bug of ours, except in whole players: appsink of 1.22 warns of its own accord when
# caps change while the application holds a sample.
G_DEBUG=fatal_warnings cargo test --locked -p gst-plugin-tetvec --lib --test decoder --test encoder --test parser
cargo test --locked -p gst-plugin-tetvec --test playback --test matrix
cargo test --locked -p tetvec --no-default-features
cargo test --locked -p tetvec --no-default-features --features encode

step "documentation"
RUSTDOCFLAGS="-D warnings" cargo doc --locked --workspace --no-deps

step "examples and benches"
cargo build --locked --workspace --examples --benches

step "miri"
if cargo +nightly miri --version >/dev/null 2>&1; then
    MIRIFLAGS=-Zmiri-disable-isolation cargo +nightly miri test --locked --no-default-features --features encode --lib -- bitstream
else
    echo "miri is not installed: the stream's modules are not interpreted"
fi

# Without coverage and for some seconds only: a look whether the targets still hold.
step "fuzz targets"
cargo clippy --locked --manifest-path fuzz/Cargo.toml --no-default-features -- -D warnings
cargo build --locked --release --manifest-path fuzz/Cargo.toml --no-default-features
for target in packets slab render round_trip feed; do
    fuzz/target/release/drive "$target" 10
done

step "meson"
# Meson refuses a build file dated in the future, which is what a clone has where the clock was set back since.
touch meson.build
meson setup "$work/build"
meson compile -C "$work/build"
meson test -C "$work/build" --suite plugin --print-errorlogs
DESTDIR=$work/root meson install -C "$work/build" --no-rebuild
find "$work/root" -path '*/gstreamer-1.0/*gsttetvec*' | grep -q . || { echo "the plugin was not installed" >&2; exit 1; }

step "dependencies"
if command -v cargo-deny >/dev/null; then
    cargo deny --locked check
else
    echo "cargo-deny is not installed: licences and advisories are not checked"
fi

printf '\nAll checks passed in %d s.\n' "$SECONDS"
