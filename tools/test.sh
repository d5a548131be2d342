#!/bin/sh
# Installs what is missing into .venv, then checks style, types and behaviour.
set -eu
cd "$(dirname "$0")/.."
. tools/install.sh
install dev

.venv/bin/ruff check .
.venv/bin/ruff format --check .
.venv/bin/mypy
exec .venv/bin/pytest -n auto --dist worksteal "$@"
