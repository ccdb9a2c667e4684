#!/bin/sh
# Makes a bare image of Debian 12 or 13 ready, as root within it: the steps of the Containerfile and of
# tools/bare.sh.
#
#   sh tools/image.sh packages   print the packages that set-up builds on
#   sh tools/image.sh run        install them, and all that a study needs (tools/setup.sh run)
#   sh tools/image.sh test       install them, and all that the tests need
set -eu
cd -- "$(dirname -- "$0")/.."

packages="make python3 python3-venv ca-certificates git"

if [ "${1-}" = packages ]; then
    echo "$packages"
    exit
fi
export DEBIAN_FRONTEND=noninteractive
apt-get -qq update
# shellcheck disable=SC2086  # a list of words
apt-get -q -y --no-install-recommends install $packages
sh tools/setup.sh "${1-}"
