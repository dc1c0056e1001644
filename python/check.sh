#!/usr/bin/env bash
# Builds the wheel, and tries it in a folder of its own as a user has it: pytest, the notebook, the types.
# SLIPWATCH_PYTHON_PROFILE: release (as users build it) or dev, which shares what `cargo test` has compiled.
set -euo pipefail
cd "$(dirname "$0")"

skip() {
    echo "skipped: the Python package: $1" >&2
    exit 0
}
command -v python3 >/dev/null || skip "python3 is not installed"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv" 2>/dev/null || skip "python3 has no venv"
python=$work/venv/bin/python
"$python" -m pip install --quiet 'maturin>=1.7,<2' numpy pandas polars matplotlib pytest nbclient nbformat ipykernel \
    >"$work/pip" 2>&1 || skip "PyPI is not there ($(tail -n 1 "$work/pip"))"

started=$SECONDS
CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/../target} "$work/venv/bin/maturin" build --quiet --locked \
    --profile "${SLIPWATCH_PYTHON_PROFILE:-dev}" --interpreter "$python" --out "$work/wheels"
echo "built in $((SECONDS - started)) s: $(cd "$work/wheels" && ls)"
"$python" -m pip install --quiet --no-index --find-links "$work/wheels" slipwatch
# From another folder, so that the installed package is tried and not the sources.
cp -r tests preonzo.ipynb "$work/"
cd "$work"
mkdir python && mv tests preonzo.ipynb python/
ln -s "$OLDPWD/../recordings" recordings
"$python" -m pytest --quiet python/tests
