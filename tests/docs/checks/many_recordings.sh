# All recordings were run by xargs, and none of them again by the array of jobs.
for name in monday tuesday rig; do
  grep -q '"state": "finished"' "results/$name.json"
  [ -s "results/$name/report.html" ]
  grep -rqx "$name: finished before" slurm_*.log
done
[ "$(grep -c ': begins' block.out)" -eq 3 ]
grep -q 'tuesday' results/compare.html
grep -q '3 runs compared' block.out
