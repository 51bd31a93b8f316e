#!/bin/bash
# Writes, on stdout, the script that hands a study to Slurm: grains; an array of samples; an array of runs; the report. Called by studies.mk.
# Usage: slurm.sh <studies.mk> <study> <out> <grains> "<samples>" "<runs>" NAME=VALUE...
set -euo pipefail
makefile=$1 study=$2 out=$3 grains=$4 samples=$5 runs=$6
shift 6

# The samples that others are swapped from come first: two tasks never make the same file.
base=() swapped=()
for sample in $samples; do
    case $(basename "$sample") in
        ls-sphere_* | sphere-sphere_*) base+=("$sample") ;;
        *)
            swapped+=("$sample")
            from=$(dirname "$sample")/ls-sphere_${sample##*_}
            [[ " ${base[*]} " == *" $from "* ]] || base+=("$from")
            ;;
    esac
done
quoted() { printf '%q ' "$@"; }

cat <<HEAD
#!/bin/bash
# The study "$study" as Slurm jobs. Submit with: $out/$study.slurm.sh [options of sbatch, such as --partition=long]
# Every task can be stopped (time limit, pre-emption) and submitted again: what is finished stays, a run goes on from its checkpoint.
set -euo pipefail
threads=\${THREADS:-8}          # cores of a task
hours=\${HOURS:-24}             # time limit of a task
make_study() { exec make --no-print-directory -f $(quoted "$makefile") $(for setting in "$@"; do [[ $setting == *= ]] || quoted "$setting"; done)THREADS=\$threads "\$@"; }
grains=$(quoted "$grains")
samples=($(quoted "${base[@]}"))
swapped=($([ ${#swapped[@]} -eq 0 ] || quoted "${swapped[@]}"))
runs=($(quoted $runs))
HEAD
cat <<'BODY'

case ${1:-} in
    # What a task does: SLURM_ARRAY_TASK_ID names its part.
    --task-grains) make_study "$grains"; exit ;;
    --task-sample) make_study "${samples[$SLURM_ARRAY_TASK_ID]}"; exit ;;
    --task-swapped) make_study "${swapped[$SLURM_ARRAY_TASK_ID]}"; exit ;;
    --task-run) make_study "${runs[$SLURM_ARRAY_TASK_ID]}"; exit ;;
BODY
printf '    --task-report) make_study FINISHED=yes %q; exit ;;\nesac\n\n' "$study"
cat <<BODY
here=\$(readlink -f "\${BASH_SOURCE[0]}")
logs=$(quoted "$out/logs")
BODY
cat <<'BODY'
mkdir -p $logs
# Two minutes before the limit Slurm sends SIGTERM to make (exec above), which passes it on to the tool: it writes a checkpoint.
submit() { sbatch --parsable --cpus-per-task="$threads" --time="$hours:00:00" --signal=B:TERM@120 --output="$logs/%x-%A_%a.txt" "$@"; }
last=$(submit --job-name=grains "${@}" "$here" --task-grains)
last=$(submit --job-name=samples --dependency=afterok:$last --array=0-$((${#samples[@]} - 1)) "${@}" "$here" --task-sample)
if [ ${#swapped[@]} -gt 0 ]; then
    last=$(submit --job-name=swapped --dependency=afterok:$last --array=0-$((${#swapped[@]} - 1)) "${@}" "$here" --task-swapped)
fi
last=$(submit --job-name=runs --dependency=afterok:$last --array=0-$((${#runs[@]} - 1)) "${@}" "$here" --task-run)
# afterany: a run that failed leaves a report of the others.
last=$(submit --job-name=report --dependency=afterany:$last "${@}" "$here" --task-report)
echo "submitted; the report is job $last"
BODY
