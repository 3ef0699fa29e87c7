#!/usr/bin/env bash
# Installs LinuxCNC from Debian's packages, and a screen without a display, for the tests that run it; without apt or root it only says so.
set -euo pipefail
if command -v linuxcnc >/dev/null && command -v halcompile >/dev/null && command -v Xvfb >/dev/null; then
    exit 0
fi
if ! command -v apt-get >/dev/null || [ "$(id -u)" -ne 0 ]; then
    echo "LinuxCNC is not installed: that takes apt-get and root. Its tests will be skipped." >&2
    exit 0
fi
if ! { timeout 120 apt-get update -qq && DEBIAN_FRONTEND=noninteractive timeout 600 apt-get install -y -qq --no-install-recommends \
    linuxcnc-uspace linuxcnc-uspace-dev xvfb xdotool imagemagick libgl1-mesa-dri; } >/dev/null; then
    echo "Debian's packages of LinuxCNC can't be installed here. Its tests will be skipped." >&2
fi
