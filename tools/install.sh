# Sourced by the scripts beside it, from the top folder: defines `install`.
#
#   install        puts the planner into .venv
#   install dev    and with it what the checks need
#
# What is already there is left alone: .venv/installed remembers what was installed from which
# pyproject.toml, so a second call takes no time.

SUMO_LIBRARIES="libgl1 libx11-6 libxext6 libxrender1 libatomic1"
BROWSER="chromium chromium-driver xvfb"

install() {
    extras=${1:-}
    wanted="$(cksum <pyproject.toml) in $(pwd -P)"
    if ! is_installed "$wanted" "$extras"; then
        make_venv
        install_packages "$extras"
        find_sumo_libraries
        if [ "$extras" = dev ]; then find_browser; fi
        compile_searches
        remember "$wanted" "$extras"
    fi
}

is_installed() {
    [ -x .venv/bin/planner ] && [ -f .venv/installed ] || return 1
    for found in "$1, dev" "$1, $2"; do
        if grep -qxF "$found" .venv/installed; then return 0; fi
    done
    return 1
}

remember() {
    printf '%s, %s\n' "$1" "$2" >.venv/installed
}

fail() {
    printf 'install: %s\n' "$@" >&2
    exit 1
}

say() {
    printf 'install: %s\n' "$@" >&2
}

is_new_enough() {
    "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null
}

find_python() {
    for python in ${PYTHON:-python3 python3.13 python3.12 python3.11}; do
        if is_new_enough "$python"; then return 0; fi
    done
    fail "Python 3.11 or later is needed, and ${PYTHON:-python3} is $(${PYTHON:-python3} --version 2>&1)" \
        "name another one: PYTHON=/path/to/python3.11 sh $0"
}

make_venv() {
    if [ -e .venv ] && ! belongs_here; then
        say "making .venv anew: it was made for another folder or by a Python that is gone"
        rm -rf .venv
    fi
    if [ -e .venv ]; then return 0; fi
    find_python
    if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
        package=$("$python" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')
        say "Python's venv module is missing"
        apt_install "$package"
    fi
    "$python" -m venv .venv || fail "$python -m venv .venv failed: see above"
}

# The programs in .venv/bin carry the folder's full name in their first line.
belongs_here() {
    is_new_enough .venv/bin/python && grep -qF "$(pwd -P)/.venv" .venv/bin/activate
}

install_packages() {
    say "putting Python packages into .venv: about a minute and 1.7 GB, once"
    .venv/bin/python -m pip --version >/dev/null 2>&1 || .venv/bin/python -m ensurepip >/dev/null
    # SUMO's Python files are many, and hardly one of them is used: no bytecode of them.
    sumo=$(grep -oE '(eclipse-sumo|libsumo|sumolib)==[0-9.*]+' pyproject.toml || true)
    if [ -n "$sumo" ]; then
        # shellcheck disable=SC2086  # a list of words
        .venv/bin/python -m pip install --quiet --disable-pip-version-check --no-compile $sumo ||
            fail "pip failed: see above; run this again when it is mended"
    fi
    .venv/bin/python -m pip install --quiet --disable-pip-version-check \
        --editable ".${1:+[$1]}" || fail "pip failed: see above; run this again when it is mended"
}

# What a search compiles is compiled now, so that the first one does not wait for it.
compile_searches() {
    say "compiling the searches for this machine: a minute or two, once"
    .venv/bin/planner doctor --compile >&2 || say "that failed; the first search will try again"
}

find_sumo_libraries() {
    if .venv/bin/python -c 'import libsumo' >/dev/null 2>&1; then return 0; fi
    say "system libraries that SUMO needs are missing"
    # shellcheck disable=SC2086  # a list of words
    apt_install $SUMO_LIBRARIES
    .venv/bin/python -c 'import libsumo' || fail "SUMO's library still does not load: see above"
}

# Tests look at pages and windows where that needs no password to install; else they are skipped.
find_browser() {
    if command -v chromium && command -v chromedriver && command -v Xvfb; then return 0; fi >/dev/null
    if ! command -v apt-get >/dev/null || needs_password; then
        say "there is no browser: tests that look at pages will be skipped; for them type" \
            "sudo apt-get install $BROWSER"
        return 0
    fi
    # shellcheck disable=SC2086  # a list of words
    apt_install $BROWSER
}

needs_password() {
    [ "$(id -u)" -ne 0 ] && ! sudo -n true 2>/dev/null
}

# Installs Debian packages where that needs no password, else says how.
apt_install() {
    as_root=
    if [ "$(id -u)" -ne 0 ]; then as_root="sudo"; fi
    if ! command -v apt-get >/dev/null; then
        fail "install what this system calls the Debian packages $*, then run this again"
    elif needs_password; then
        fail "type this, then run this again:" "sudo apt-get install $*"
    fi
    say "installing with apt-get: $*"
    if ! {
        $as_root apt-get update -qq &&
            $as_root env DEBIAN_FRONTEND=noninteractive \
                apt-get install -y -qq --no-install-recommends "$@" >/dev/null
    } >&2; then
        fail "apt-get failed: see above; what is needed: apt-get install $*"
    fi
}
