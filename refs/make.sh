#!/usr/bin/env bash
# Renders the reference pictures anew, with Mitsuba: all of them, or those named. Needs Rust, Python 3.11 or newer and a
# package index; makes a Python environment of its own with the versions of tests/peers/requirements.txt.
#
#     refs/make.sh [NAME...]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

target=${CARGO_TARGET_DIR:-target}
venv=$target/peers-venv
cargo build --release
python3 -m venv "$venv"
"$venv/bin/pip" install --quiet --disable-pip-version-check -r tests/peers/requirements.txt
PYTHONDONTWRITEBYTECODE=1 PYTHONUNBUFFERED=1 "$venv/bin/python" tests/peers/reference.py "$@"
