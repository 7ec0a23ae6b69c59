#!/usr/bin/env bash
# Gradescope runs this once, as root, when it builds the image of the assignment.
set -eu
export DEBIAN_FRONTEND=noninteractive
# The kit needs Python 3.11 to 3.14; which one a package exists for depends on the image.
if ! command -v python3.14 python3.13 python3.12 python3.11 >/dev/null; then
    apt-get update
    for version in 3.12 3.11 3.13; do
        apt-get install -y --no-install-recommends "python$version" "python$version-venv" && break
    done
fi
cd "$(dirname "$0")/kit"
for python in python3.14 python3.13 python3.12 python3.11; do
    if command -v "$python" >/dev/null; then
        exec "$python" -c 'import sys; from autograder.setup.bootstrap import main; sys.exit(main())'
    fi
done
echo "No Python from 3.11 to 3.14 could be installed in this image. Choose a newer image for the assignment." >&2
exit 1
