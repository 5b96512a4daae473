# shellcheck shell=bash
# Sourced by the scripts beside it, from the project's root. Each function installs what is missing and is quick when nothing
# is: Debian packages, the virtual environment .venv, and the package itself, built in build/dev.

build_packages=(g++ cmake ninja-build ccache pkg-config libeigen3-dev libflann-dev liblz4-dev libceres-dev
  nlohmann-json3-dev libgtest-dev locales)
python_packages=(python3-venv python3-dev)
# shellcheck disable=SC2034 # scripts/test uses it
lint_packages=(clang-format shellcheck)
# shellcheck disable=SC2034 # scripts/test and scripts/verify use it: sanitizers, fuzzing
clang_packages=(clang-15)
# shellcheck disable=SC2034 # scripts/verify uses it: what tests/python/test_beside_others.py loads from Debian
peer_packages=(python3-torch libpcl-registration1.13 libceres-dev libflann-dev libgomp1)
venv=$PWD/.venv

# need_packages PACKAGE...: by apt, with sudo where not root.
need_packages() {
  if ! command -v dpkg-query > /dev/null; then
    echo "not a Debian system; these packages or their like must be there: $*" >&2
    return
  fi
  local package missing=() as_root=()
  for package; do
    [[ $(dpkg-query -W -f '${db:Status-Status}' "$package" 2> /dev/null) == installed ]] || missing+=("$package")
  done
  ((${#missing[@]})) || return 0
  echo "-- apt-get install ${missing[*]}"
  ((EUID == 0)) || as_root=(sudo)
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" > /dev/null
}

# once STAMP KEY COMMAND...: runs the command unless it has succeeded before with the same key.
once() {
  local stamp=$1 key=$2
  shift 2
  [[ ! -f $stamp || $(< "$stamp") != "$key" ]] || return 0
  "$@"
  echo "$key" > "$stamp"
}

# The virtual environment with what pyproject.toml asks for: to build, to run (with all extras), to test. What only
# scripts/package needs (the extra `release`) comes with need_release.
need_venv() {
  need_packages "${python_packages[@]}"
  once "$venv/requirements.stamp" "$(cat pyproject.toml scripts/setup.sh | sha256sum)" make_venv
}

make_venv() {
  echo "-- virtual environment .venv"
  [[ -x $venv/bin/pip ]] || /usr/bin/python3 -m venv --clear "$venv"
  pip_install base
}

need_release() {
  need_venv
  once "$venv/release.stamp" "$(< "$venv/requirements.stamp")" pip_install release
}

# pip_install base|release: what pyproject.toml asks for, all but the extra `release`, or that alone.
pip_install() {
  "$venv/bin/python" - "$1" > "$venv/requirements.txt" << 'EOF'
import sys, tomllib
with open("pyproject.toml", "rb") as file:
    content = tomllib.load(file)
project = content["project"]
extras = project["optional-dependencies"]
release = extras.pop("release")
base = content["build-system"]["requires"] + project["dependencies"] + sum(extras.values(), [])
print(*(release if sys.argv[1] == "release" else base), sep="\n")
EOF
  "$venv/bin/pip" install -q -r "$venv/requirements.txt"
}

# The package in the virtual environment, editable: Python files are used where they lie, so only a change of a C++ file or of
# the list of files needs another installation. build/dev is one tree with what `cmake --preset dev` builds.
need_sgrt() {
  need_packages "${build_packages[@]}"
  need_venv
  local key
  key=$({
    find CMakeLists.txt cmake include libsgrt bindings/python pyproject.toml -type f ! -name '*.py*' -print0 | sort -z | xargs -0 sha256sum
    find bindings/python -name '*.py*' ! -name '*.pyc' | sort
  } | sha256sum)
  once "$venv/sgrt.stamp" "$key" install_sgrt
}

install_sgrt() {
  echo "-- building sgrt in build/dev"
  "$venv/bin/pip" install -q --no-build-isolation --no-deps -e . --config-settings=build-dir=build/dev
}

# Libraries that a product may have in the same process, in an environment of their own: .venv-peers, which the benchmarks use
# too.
need_peers() {
  [[ -x .venv-peers/bin/pip ]] || /usr/bin/python3 -m venv .venv-peers
  .venv-peers/bin/pip install -q -r benchmarks/peers.txt scikit-learn pyceres
}
