#!/bin/sh
# One run of a sweep as an entry of a SLURM job array:
#
#   sbatch --array=0-39 examples/sweeps/array-job.sh examples/sweeps/figure6.toml
#
#SBATCH --cpus-per-task=1 --time=01:00:00 --requeue --signal=B:USR1@120
mackrl sweep "$1" --index "$SLURM_ARRAY_TASK_ID" --threads 1 --time-limit 55m
code=$?
# 75: it stopped with a checkpoint and wants to be started again.
test $code -ne 75 || scontrol requeue "${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}"
exit $code
