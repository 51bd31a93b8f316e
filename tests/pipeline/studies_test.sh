#!/bin/bash
# pipeline/studies.mk on the smallest samples: a study with two seeds runs to its report, a second call does nothing, a study that shares runs
# makes only what it lacks, a stopped run goes on, and the jobs for a cluster do the same work.
# Usage: studies_test.sh <source folder> <bin folder> <scratch folder>
set -euo pipefail
source=$1 bin=$2 scratch=$3
rm -rf "$scratch"
mkdir -p "$scratch"
cd "$scratch"
fail() { echo "FAILED: $*" >&2; exit 1; }

sed 's/"level-set"/"sphere"/; /^file/d; /^surface_nodes/d' "$source/tests/pipeline/pack.toml" >spheres.toml
"$bin/make-sample-ct" -o scan.tif --grains 2 --sticks 0 --diameter 7mm --voxel-size 0.25mm --seed 3 --quiet
settings=(bin="$bin" CT=scan.tif CALLER="$scratch" OUT=out SPEC="$source/tests/pipeline/pack.toml" SPEC_SPHERES=spheres.toml SPACING=0.8mm SCALE_TO=7mm CELL=0.7mm
    DURATION=4ms THREADS=1 HOLE=2.8mm)
study() { make --no-print-directory -f "$source/pipeline/studies.mk" "${settings[@]}" "$@"; }

study voids SEEDS=2 -j 2 >first.txt || fail "the study did not run"
[ "$(grep -c '^== suffuse' first.txt)" = 4 ] || fail "not four runs: $(grep -c '^== suffuse' first.txt)"
[ -s out/voids/report/report.html ] || fail "no report"
grep -q '^"\?LS-sphere"\?,.*' out/voids/report/figures/eroded_mass.csv || fail "the figure does not hold the mean of LS-sphere"

study voids SEEDS=2 >second.txt
! grep '^==' second.txt || fail "a part ran again although nothing had changed"
study paper SEEDS=2 >third.txt
! grep -q '^== \(suffuse\|pack-sample\)' third.txt || fail "a run that two studies share was made twice"

# A run stopped by a signal leaves a checkpoint; here it is one that a part of the run left.
rm out/ls-sphere/seed1/suffuse.txt
"$bin/suffuse" out/ls-sphere/seed1 --until 2ms --quiet
study paper SEEDS=2 >fourth.txt 2>&1 || { cat fourth.txt; fail "the stopped run did not go on"; }
grep -q 'resumed at t = ' fourth.txt || fail "the stopped run began anew"

# The jobs for Slurm, run here one by one in the order of their dependencies.
study slurm STUDY=shapes SEEDS=1 >slurm.txt
cat >sbatch <<'FAKE'
#!/bin/bash
while [ "${1#--}" != "$1" ]; do case $1 in --array=*) array=${1#--array=}; esac; shift; done
for task in $(seq "${array%-*}" "${array#*-}" 2>/dev/null || echo 0); do SLURM_ARRAY_TASK_ID=$task "$@" >>jobs.txt 2>&1 || exit 1; done
echo 7
FAKE
chmod +x sbatch
PATH=$scratch:$PATH THREADS=1 out/shapes.slurm.sh >submitted.txt || { tail -20 jobs.txt; fail "a job failed"; }
grep -q 'the report is job 7' submitted.txt || fail "the jobs were not handed over"
[ -s out/shapes/report/report.html ] || fail "the jobs left no report"

! study voids SCALE=huge >bad.txt 2>&1 || fail "a wrong scale was taken"
grep -q 'is not one of: small, paper' bad.txt || fail "no word on the wrong scale"
