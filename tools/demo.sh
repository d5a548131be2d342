#!/bin/sh
# Installs what is missing into .venv, then plans and flies the search of the 5x5 grid on SUMO.
set -eu
cd "$(dirname "$0")/.."
. tools/install.sh
install

planner=.venv/bin/planner
out=runs/grid5x5

run() {
    printf '\n$ planner %s\n' "$*"
    "$planner" "$@"
}

run plan sumo_nets/grid5x5 -o "$out" --force
run fly "$out"
run where sumo_nets/grid5x5 --at 1800
run compare sumo_nets/grid5x5
printf '\nThe picture of the plan: %s/plan.png\n' "$out"
