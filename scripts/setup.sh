#!/bin/sh
# Prepares this folder; the Makefile calls it, and it may be run again at any time.
#   setup.sh packages [GROUP]   .venv with somatopy (editable) and what it needs; GROUP: test, bench, docs
#   setup.sh gl                 OpenGL without a display, for the rendered eye
#   setup.sh osmesa             the fallback too, where it can be had, for its tests
#   setup.sh browser            Chromium and its driver, for the tests of the report
# As root on Debian or Ubuntu it installs the system packages that are missing; else it says which they are.
set -eu
cd "$(dirname "$0")/.."

# PyOpenGL looks for libOpenGL even under EGL. OSMesa is the fallback: newer systems no longer have it.
EGL_PACKAGES="libegl1 libgl1-mesa-dri libopengl0"
OSMESA_PACKAGES="libosmesa6"
BROWSER_PACKAGES="chromium chromium-driver"

say() { printf 'somatopy: %s\n' "$*" >&2; }
fail() { say "$*"; exit 1; }

apt_install() {
    [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null || return 1
    say "installing the system packages $*"
    export DEBIAN_FRONTEND=noninteractive
    apt-get update -qq && apt-get install -qq --no-install-recommends "$@" >/dev/null
}

find_python() {
    for python in ${PYTHON:-python3 python3.14 python3.13 python3.12 python3.11}; do
        if "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            echo "$python"
            return
        fi
    done
    return 1
}

make_venv() {
    python=$(find_python) || { apt_install python3 python3-venv && python=$(find_python); } ||
        fail "needs Python 3.11 or later, and found none (python3: $(python3 --version 2>/dev/null || echo not found))." \
            "Install it, or name it: make PYTHON=/path/to/python3.12"
    venv_package=$("$python" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')
    "$python" -c 'import ensurepip' 2>/dev/null || apt_install "$venv_package" ||
        fail "$python cannot make virtual environments. Install its venv module (Debian, Ubuntu: apt-get install $venv_package)."
    "$python" -m venv --clear .venv
}

pip_install() { .venv/bin/python -m pip install --quiet --disable-pip-version-check "$@"; }

install_packages() {
    .venv/bin/python -m pip --version >/dev/null 2>&1 || make_venv
    say "installing the Python packages into .venv (the first time takes some minutes)"
    # Older ones do not know dependency groups.
    pip_install "pip>=25.1"
    case "${1:-}" in
        "") pip_install --editable ".[all]" ;;
        test) pip_install --editable ".[all,cluster,robots,tensorboard,wandb]" --group test ;;
        *) pip_install --editable ".[all]" --group "$1" ;;
    esac
    # Its models are for any MuJoCo, but the package asks for an older one.
    [ "${1:-}" != test ] || pip_install --no-deps gym-aloha
    touch ".venv/ready${1:+-$1}"
}

# 0: a context can be made; 3: none can; anything else is an error of ours, and is shown.
probe_gl() {
    .venv/bin/python - <<'PYTHON'
import sys

from somatopy.bodies.rendering import NoGL, gl_backend

try:
    gl_backend()
except NoGL:
    sys.exit(3)
PYTHON
}

gl_missing() {
    status=0
    probe_gl || status=$?
    [ "$status" = 0 ] && touch .venv/gl
    [ "$status" = 3 ]
}

prepare_gl() {
    if [ -e .venv/gl ] || ! gl_missing; then return; fi
    for packages in "$EGL_PACKAGES" "$OSMESA_PACKAGES"; do
        # shellcheck disable=SC2086  # a list of words
        if apt_install $packages && ! gl_missing; then return; fi
    done
    say "no OpenGL context can be made here (neither EGL nor OSMesa), so no camera image can be rendered." \
        "Install $EGL_PACKAGES (or else $OSMESA_PACKAGES) with apt-get install on Debian or Ubuntu, and call make again." \
        "Going on without: tests that render will be listed as not run; '--eye geometric' needs no OpenGL" \
        "(make reproduce ARGS=\"--eye geometric\")."
}

prepare_browser() {
    if command -v chromium >/dev/null && command -v chromedriver >/dev/null; then return; fi
    # shellcheck disable=SC2086  # a list of words
    apt_install $BROWSER_PACKAGES ||
        say "no Chromium with its driver is here, so that the tests which open a report will be listed as not run." \
            "Install $BROWSER_PACKAGES with apt-get install on Debian, and call make again."
}

case "${1:-}" in
    packages) install_packages "${2:-}" ;;
    gl) prepare_gl ;;
    osmesa) ldconfig -p | grep -q libOSMesa || apt_install $OSMESA_PACKAGES || say "goes on without OSMesa" ;;
    browser) prepare_browser ;;
    *) fail "usage: scripts/setup.sh packages [GROUP] | gl | osmesa | browser" ;;
esac
