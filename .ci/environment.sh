# shellcheck shell=sh
# Sourced by ./start and ./test: makes the project's own environment in .venv from uv.lock.
# Needs nothing of the system but Python 3.11 to 3.13 with pip; changes nothing outside the project's folder.

# Compiled modules are kept in the project's own folder: without them every start takes three seconds longer.
unset PYTHONDONTWRITEBYTECODE

fail() {
    echo "$(basename "$0"): $*" >&2
    exit 1
}

find_python() { # prints a Python that the project runs on
    for candidate in python3 python3.13 python3.12 python3.11; do
        if "$candidate" -c 'import os, sys
if not (3, 11) <= sys.version_info[:2] < (3, 14):
    sys.exit(1)
print(os.path.realpath(sys.executable))' 2>/dev/null; then
            return
        fi
    done
    fail "needs Python 3.11, 3.12 or 3.13 as python3; install it, such as: apt-get install python3 python3-pip"
}

find_uv() { # sets UV; without uv on the system it goes to .tools/uv, by pip
    UV=$(command -v uv || true)
    if [ -n "$UV" ] && "$UV" --version >/dev/null 2>&1; then return; fi
    UV=$ROOT/.tools/uv/bin/uv
    if [ -x "$UV" ]; then return; fi
    echo "Installing uv into .tools/uv ..." >&2
    mkdir -p "$ROOT/.tools"
    rm -rf "$ROOT/.tools/uv"
    if "$PYTHON" -m pip --version >/dev/null 2>&1; then
        "$PYTHON" -m pip install --quiet --disable-pip-version-check --no-warn-script-location \
            --root-user-action=ignore --target "$ROOT/.tools/uv" uv ||
            fail "pip could not install uv (see above)"
    elif "$PYTHON" -m venv "$ROOT/.tools/uv" >/dev/null 2>&1; then
        "$ROOT/.tools/uv/bin/python" -m pip install --quiet --disable-pip-version-check uv ||
            fail "pip could not install uv (see above)"
    else
        rm -rf "$ROOT/.tools/uv"
        fail "needs pip; install it, such as: apt-get install python3-pip"
    fi
}

environment() { # environment [options of uv sync]: makes .venv what uv.lock says
    PYTHON=$(find_python) || exit 1
    find_uv
    if [ ! -x "$ROOT/.venv/bin/studio" ]; then
        echo "Installing the studio into .venv (once, about half a gigabyte) ..." >&2
    fi
    UV_PROJECT_ENVIRONMENT="$ROOT/.venv" UV_PYTHON_DOWNLOADS=never VIRTUAL_ENV="" \
        "$UV" sync --quiet --frozen --inexact --project "$ROOT" --python "$PYTHON" "$@" ||
        fail "uv could not install the packages of uv.lock (see above)"
}
