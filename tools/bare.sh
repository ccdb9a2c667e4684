#!/bin/sh
# Runs the main job and the tests on Debian from the bare image, as root on a Debian with mmdebstrap:
#
#   sh tools/bare.sh DIRECTORY [RELEASE ...]    of bookworm (12) and trixie (13), else both
#
# For each release mmdebstrap makes an image in DIRECTORY, with this machine's settings of apt and pip
# and its certificates. Within it, on a copy of the last commit: tools/image.sh, `make study`,
# `make test test-long`. RELEASE.log in DIRECTORY has all that is said. Printed are the times, the last line of
# each step and the tests that failed. The image is removed. A release takes 5 GB.
set -eu

say() { printf '%s\n' "$*"; }

die() {
    say "bare.sh: $*" >&2
    exit 1
}

# Where the copy lies in the image: nothing may depend on a path without blanks and quotes.
checkout="/srv/the user's \"checkout\""

# One step: its name and its command; what it says goes to the log.
step() {
    name=$1
    shift
    say "== $name" >>"$log"
    began=$(date +%s)
    code=0
    "$@" >>"$log" 2>&1 </dev/null || code=$?
    seconds=$(($(date +%s) - began))
    last=$(tail -n 1 "$log" | cut -c 1-100)
    printf '%-9s %-10s %5d s, exit code %d: %s\n' "$release" "$name" "$seconds" "$code" "$last"
    return "$code"
}

# Copies a folder of pip's settings into the image, where there is one.
pip_settings() {
    [ -d "$1" ] || return 0
    mkdir -p "$2"
    cp -r "$1/." "$2"
}

image() {
    # apt's sources of Debian, of the other release; how it reaches them
    here=$(sed -n 's/^VERSION_CODENAME=//p' /etc/os-release)
    apt-get indextargets --format 'deb $(REPO_URI) $(RELEASE) $(COMPONENT)' \
        'Created-By: Packages' 'Origin: Debian' | sort -u | sed "s/ $here/ $release/" >"$root.sources"
    apt-config dump | grep -E '^Acquire::(http|https|Retries|Check-|Force)' >"$root.apt" || :
    include=$(sh tools/image.sh packages | tr ' ' ',')
    mmdebstrap --variant=minbase --include="$include" --aptopt="$root.apt" "$release" "$root" \
        - <"$root.sources" || return
    cp /etc/resolv.conf "$root/etc/"
    cp /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
    # pip's settings, with the files that they name
    [ ! -f /etc/pip.conf ] || cp /etc/pip.conf "$root/etc/"
    pip_settings /etc/xdg/pip "$root/etc/xdg/pip"
    pip_settings "$HOME/.config/pip" "$root/root/.config/pip"
    pip_settings "$HOME/.pip" "$root/root/.pip"
    mkdir -p "$root$checkout"
    git archive "$commit" | tar -x -C "$root$checkout"
}

# A command in the checkout within the image, with no more of this environment than what pip and
# proxies take from it.
within() {
    set -- PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root \
        sh -c 'cd -- "$0" && exec "$@"' "$checkout" "$@"
    for variable in $(env | sed -n 's/^\(PIP_[A-Z_]*\|[a-z]*_proxy\|[A-Z]*_PROXY\)=.*/\1/p'); do
        eval "set -- \"$variable=\$$variable\" \"\$@\""
    done
    chroot "$root" env -i "$@"
}

versions() {
    python=$(within python3 -V)
    printf '%s' "$python"
    within dpkg-query -W -f='; ${Package} ${Version}' openfoam liggghts
    echo
}

# One digest of all tables of the study: the same on every machine.
tables() { within sh -c 'cat results/first-look/tables/* | sha256sum'; }

# Within a release, in name spaces of its own: its mounts and processes end with it.
run_within() {
    mount -t proc proc "$root/proc"
    mount --rbind /dev "$root/dev"
    step set-up within sh tools/image.sh test || return
    step versions versions || :
    failed=0
    step "make study" within make study || failed=1
    step tables tables || failed=1
    step "make test" within make test test-long || failed=1
    return "$failed"
}

run_release() {
    step image image || return
    setsid --wait unshare --mount --pid --fork --kill-child \
        sh tools/bare.sh --within "$release" "$root" "$log"
}

main() {
    if [ "${1-}" = --within ]; then
        release=$2 root=$3 log=$4
        run_within
        return
    fi
    [ $# -gt 0 ] || die "usage: sh tools/bare.sh DIRECTORY [RELEASE ...]"
    [ "$(id -u)" -eq 0 ] || die "needs root: for chroot, and the tests mount a file system"
    command -v mmdebstrap >/dev/null || die "needs mmdebstrap: apt-get install mmdebstrap"
    mkdir -p -- "$1"
    directory=$(cd -- "$1" && pwd)
    shift
    [ $# -gt 0 ] || set -- bookworm trixie
    cd -- "$(dirname -- "$0")/.."

    commit=$(git rev-parse --short HEAD)
    say "commit $commit, $(date -u +%F), $(nproc) cores"
    ended=0
    for release in "$@"; do
        root=$directory/$release log=$directory/$release.log
        [ ! -e "$root" ] || die "there is $root already: remove it"
        : >"$log"
        run_release || {
            ended=1
            grep -E '^(FAILED|ERROR) ' "$log" || :
        }
        rm -rf --one-file-system -- "$root" "$root.sources" "$root.apt"
    done
    return "$ended"
}

main "$@"
