#!/bin/bash
# The chain of pipeline/chain.mk from a small phantom to a report; a second call does nothing; a changed option redoes its step only.
# Usage: chain_test.sh <source folder> <bin folder> <scratch folder>
set -euo pipefail
source=$1 bin=$2 scratch=$3
rm -rf "$scratch"
mkdir -p "$scratch"
cd "$scratch"
fail() { echo "FAILED: $*" >&2; exit 1; }

"$bin/make-sample-ct" -o scan.tif --truth truth.csv --grains 2 --sticks 0 --diameter 7mm --voxel-size 0.25mm --seed 3 --quiet
run() {
    make --no-print-directory -f "$source/pipeline/chain.mk" report bin="$bin" CALLER="$scratch" CT=scan.tif OUT=out \
        SPEC="$source/tests/pipeline/pack.toml" CELL=0.7mm DURATION=20ms "$@"
}
run | tee first.txt
grep -q '^== suffuse' first.txt || fail "suffuse did not run"
grep -q "^report: $scratch/out/report/report.html" first.txt || fail "the last lines do not name the report"
grep -q '^eroded: [0-9.]* % of the fine mass' first.txt || fail "the last lines do not tell the eroded mass"
[ -s out/report/report.html ] && [ -s out/report/erosion.csv ] || fail "the report is not there"

run >second.txt
! grep '^==' second.txt || fail "a step ran again although nothing had changed"
run VELOCITY=0.05m/s >third.txt
! grep -q '^== \(csct2ls\|ls2sh\|pack-sample\)' third.txt || fail "a step before the changed option ran again"
grep -q '^== make-case' third.txt && grep -q '^== erosion-report' third.txt || fail "the steps after the changed option did not run"
