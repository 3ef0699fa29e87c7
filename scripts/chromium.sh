#!/usr/bin/env bash
# Installs Chromium from Debian's packages, for the tests that open pages; without apt or root it only says so.
set -euo pipefail
if command -v chromium >/dev/null; then
    exit 0
fi
if ! command -v apt-get >/dev/null || [ "$(id -u)" -ne 0 ]; then
    echo "Chromium is not installed: that takes apt-get and root. The tests of pages will be skipped." >&2
    exit 0
fi
if ! { timeout 120 apt-get update -qq && DEBIAN_FRONTEND=noninteractive timeout 600 apt-get install -y -qq --no-install-recommends \
    chromium; } >/dev/null; then
    echo "Debian's package of Chromium can't be installed here. The tests of pages will be skipped." >&2
fi
