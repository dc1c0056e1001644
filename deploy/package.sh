#!/usr/bin/env bash
# Builds the Debian package and prints its path. Needs cargo-deb (cargo install cargo-deb) and dpkg.
# usage: deploy/package.sh [OUT_DIR] [BINARY]    with a binary nothing is compiled
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-target/debian}
binary=${2:-}
cargo=${CARGO:-cargo}

if [ -z "$binary" ]; then
    "$cargo" build --release --locked >&2
    binary=target/release/slipwatch
fi
stage=target/package
rm -rf "$stage"
mkdir -p "$stage/completions" "$out"
install -m 755 "$binary" "$stage/slipwatch"
"$stage/slipwatch" man "$stage/man"
gzip --best --no-name "$stage"/man/*
"$stage/slipwatch" completions bash >"$stage/completions/slipwatch"
"$stage/slipwatch" completions zsh >"$stage/completions/_slipwatch"
"$stage/slipwatch" completions fish >"$stage/completions/slipwatch.fish"
# A binary that was handed in is a trial, and xz takes half a minute.
"$cargo" deb --no-build ${2:+--fast} --output "$out"
