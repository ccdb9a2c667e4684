#!/bin/sh
# Makes a machine with Debian 12 or 13 ready.  A second call finds all in place and asks no server for
# anything.  On other systems the Containerfile makes an image of Debian 13 with the same steps.
#
#   sh tools/setup.sh run      Debian packages, and .venv with what requirements.lock pins and the
#                              extra [gis]: what requirements-gis.lock pins
#   sh tools/setup.sh cluster  the same, and the extra [cluster]: what requirements-cluster.lock pins
#   sh tools/setup.sh test     the same, a Slurm to test it with, and what requirements-test.lock pins
#   sh tools/setup.sh docs     the same, and the extra [docs]: what requirements-docs.lock pins
#   sh tools/setup.sh lock     resolve pyproject.toml anew into the five lock files
set -eu
unset CDPATH
cd -- "$(dirname -- "$0")/.."

solvers="openfoam liggghts"
# What the gmsh wheel links against.
gmsh_libraries="libgl1 libglu1-mesa libxft2 libxcursor1 libxinerama1 libgomp1"
# What the tests of a cluster start nodes with; filled in for the tests alone.
slurm=

environment=.venv
# Written last, so that a set-up cut short leaves none: the checksums of the lock files installed.
stamp=$environment/installed.sha256

say() { printf 'setup: %s\n' "$*" >&2; }
die() {
    say "$@"
    exit 1
}

missing_packages() {
    wanted="$solvers $gmsh_libraries $slurm"
    # Any Python will do to make the environment with; Debian's comes without the means.
    if ! venv_works && ! python3 -c 'import ensurepip, venv' 2>/dev/null; then
        wanted="python3 python3-venv $wanted"
    fi
    # shellcheck disable=SC2086  # a list of words
    found=" $(dpkg-query -W -f='${db:Status-Status}:${Package} ' $wanted 2>/dev/null || :)"
    for package in $wanted; do
        case $found in
        *" installed:$package "*) ;;
        *) printf '%s ' "$package" ;;
        esac
    done
}

# The import fails once Debian's python3 has moved on to another minor version.
venv_works() { "$environment/bin/python" -c 'import pip' 2>/dev/null; }

venv_holds() {
    for file in "$@"; do
        grep -qsF "  $file" "$stamp" || return 1
    done
    sha256sum --check --status "$stamp" 2>/dev/null && venv_works
}

check_python() {
    if command -v python3 >/dev/null &&
        ! python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
        die "needs Python 3.11 or newer; $(command -v python3) is $(python3 -V 2>&1)"
    fi
}

install_packages() {
    missing=$(missing_packages)
    missing=${missing% }
    [ -n "$missing" ] || return 0
    by_hand="    apt-get update && apt-get install --no-install-recommends $missing"

    if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
        die "this system has no apt-get.  On Debian 12 or 13 one would call, as root:

$by_hand

Here, build the image of Debian 13 that the Containerfile describes (docs/install.md), or provide
OpenFOAM (1912), LIGGGHTS, Python 3.11 or newer and these libraries by other means and install the
package itself with pip.  Nothing was installed."
    fi
    if [ "$(id -u)" -eq 0 ]; then
        sudo=
    elif command -v sudo >/dev/null &&
        { sudo -n true 2>/dev/null || { [ -t 0 ] && say "needs root for: $missing" && sudo true; }; }; then
        sudo=sudo
    else
        die "missing Debian packages: $missing
Installing them takes root or sudo.  Call this once as root, then make again:

$by_hand

Nothing was installed."
    fi

    say "installing Debian packages: $missing"
    as_root apt-get -qq update || say "apt-get update failed; trying with the lists there are"
    as_root dpkg --configure -a || : # ends what an interrupted call left half done
    # shellcheck disable=SC2086
    as_root apt-get -q -y -o DPkg::Lock::Timeout=600 --fix-broken --no-install-recommends \
        install $missing || die "apt-get failed, see above.  Call make again, or as root:

$by_hand"
}

as_root() { $sudo env DEBIAN_FRONTEND=noninteractive "$@" </dev/null 9<&-; }

pip() { "$environment/bin/python" -m pip --disable-pip-version-check --no-input "$@"; }

pip_install() { pip install --no-user --only-binary :all: "$@"; }

install_venv() {
    lacking="$*"
    if venv_holds requirements.lock; then
        lacking=
        for file in "$@"; do
            venv_holds "$file" || lacking="$lacking $file"
        done
        rm -f "$stamp"
    else
        say "making $environment"
        rm -rf "$environment"
        python3 -m venv "$environment" || die "$(command -v python3) -m venv failed, see above"
    fi
    for file in $lacking; do
        say "installing what $file pins"
        pip_install --quiet --no-deps -r "$file" || die "pip failed, see above.  Call make again to go on."
    done
    sha256sum "$@" >"$stamp.new"
    mv "$stamp.new" "$stamp"
}

# The package is installed as this checkout, so that a change of a file acts at once: a file in
# site-packages names the checkout, and the command starts the Python beside it.  A command that pip
# writes would name .venv in its first line, which breaks when the path has a blank or a quote in it.
launcher='#!/bin/sh
# Starts the program of the checkout whose .venv this file is in.
exec "$(dirname -- "$(readlink -f -- "$0")")/python" -P -m orchestrator "$@"'
command=$environment/bin/orchestrator

linked() {
    [ -x "$command" ] && [ "$(cat "$command")" = "$launcher" ] || return 1
    for packages in "$environment"/lib/python3*/site-packages; do
        [ "$(cat "$packages/orchestrator.pth" 2>/dev/null)" = "$PWD" ] || return 1
    done
}

link_checkout() {
    for packages in "$environment"/lib/python3*/site-packages; do
        printf '%s\n' "$PWD" >"$packages/orchestrator.pth.new"
        mv "$packages/orchestrator.pth.new" "$packages/orchestrator.pth"
    done
    printf '%s\n' "$launcher" >"$command.new"
    chmod +x "$command.new"
    mv "$command.new" "$command"
}

ready() { venv_holds "$@" && linked && [ -z "$(missing_packages)" ]; }

set_up() {
    ! ready "$@" || return 0
    # Two calls at once: the second waits, and finds all done.
    exec 9<.
    ! command -v flock >/dev/null || flock 9
    check_python
    install_packages
    check_python
    venv_holds "$@" || install_venv "$@"
    linked || link_checkout
    "$environment/bin/python" -m compileall -q orchestrator || : # a first start without delay
    exec 9<&-
}

# The dependencies that pyproject.toml names, one a line: the package's, its extra's or the tests'.
dependencies() {
    "$environment/bin/python" -c '
import sys, tomllib
with open("pyproject.toml", "rb") as file:
    data = tomllib.load(file)
project = data["project"]
wanted = {
    "run": project["dependencies"],
    **project["optional-dependencies"],
    "test": data["dependency-groups"]["test"],
}
print(*wanted[sys.argv[1]], sep="\n")
' "$1"
}

lock() {
    check_python
    scratch=$(mktemp -d)
    trap 'rm -rf "$scratch"' EXIT
    environment=$scratch/venv
    python3 -m venv "$environment"
    header="# Written by make lock with $("$environment/bin/python" -V) on $(uname -sm)."
    : >"$scratch/pinned"
    lock_part run requirements.lock
    lock_part gis requirements-gis.lock
    lock_part cluster requirements-cluster.lock
    lock_part test requirements-test.lock
    lock_part docs requirements-docs.lock
}

# Pins what a part needs beside the parts before it.
lock_part() {
    dependencies "$1" >"$scratch/$1.in"
    pip_install -c "$scratch/pinned" -r "$scratch/$1.in"
    pip freeze | grep -vxFf "$scratch/pinned" >"$scratch/$1.lock"
    { echo "$header" && cat "$scratch/$1.lock"; } >"$2"
    cat "$scratch/$1.lock" >>"$scratch/pinned"
}

# What every set-up has.
run="requirements.lock requirements-gis.lock"

# shellcheck disable=SC2086  # a list of words
case ${1-} in
run) set_up $run ;;
cluster) set_up $run requirements-cluster.lock ;;
test)
    slurm="slurmctld slurmd slurm-client munge"
    set_up $run requirements-cluster.lock requirements-test.lock
    ;;
docs) set_up $run requirements-cluster.lock requirements-test.lock requirements-docs.lock ;;
lock) lock ;;
*) die "usage: sh tools/setup.sh run|cluster|test|docs|lock" ;;
esac
