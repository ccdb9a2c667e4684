#!/bin/sh
# Builds the wheel and the sdist of the last commit, installs each of them into an empty environment, and
# runs the program there, outside of the checkout.
#
#   sh tools/release.sh [DIRECTORY]    by default dist
#
# Nothing is uploaded and no tag is made: CONTRIBUTING.md says what is left to do by hand. Needs what
# `make test` installs, and the solvers.
set -eu
unset CDPATH
cd -- "$(dirname -- "$0")/.."

say() { printf 'release: %s\n' "$*"; }
die() {
    say "$*" >&2
    exit 1
}

python=$PWD/.venv/bin/python
[ -x "$python" ] || die "there is no .venv: make setup"
"$python" -c 'import hatchling' 2>/dev/null || die "hatchling is missing in .venv: sh tools/setup.sh test"
[ -z "$(git status --porcelain --untracked-files=no)" ] || die "there are changes that are not committed"

version=$("$python" -c 'import orchestrator; print(orchestrator.__version__)')
grep -qx "version: $version" CITATION.cff || die "CITATION.cff: its version is not $version"
grep -q "^## \[$version\] - " CHANGELOG.md ||
    say "CHANGELOG.md has no section [$version] with a date yet: this is a trial"

directory=${1:-dist}
mkdir -p -- "$directory"
directory=$(cd -- "$directory" && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# The files of the commit alone: nothing else that lies in the checkout gets into a package.
mkdir "$scratch/source"
git archive HEAD | tar -x -C "$scratch/source"
(cd "$scratch/source" && "$python" -m hatchling build -d "$directory")

# One package: install it, and run the program as a user would.
try() {
    package=$1
    name=$2
    say "$name: $(basename -- "$package"), $(wc -c <"$package") bytes"
    environment=$scratch/$name
    python3 -m venv "$environment"
    "$environment/bin/python" -m pip -q --disable-pip-version-check --no-input install \
        --only-binary :all: --no-deps -r requirements.lock
    "$environment/bin/python" -m pip -q --disable-pip-version-check --no-input install \
        --no-deps "$package"
    mkdir "$scratch/run-$name"
    cd "$scratch/run-$name"
    "$environment/bin/orchestrator" --version
    "$environment/bin/orchestrator" threshold --fluid water --diameter 1e-3 --density 2650 | head -n 12
    "$environment/bin/orchestrator" study first-look
    cat results/first-look/tables/* | sha256sum >"$scratch/$name.sha256"
    cd - >/dev/null
}

try "$directory/orchestrator-$version-py3-none-any.whl" wheel
try "$directory/orchestrator-$version.tar.gz" sdist
cmp -s "$scratch/wheel.sha256" "$scratch/sdist.sha256" || die "the tables of wheel and sdist differ"
say "wheel and sdist give the same tables; they are in $directory"
