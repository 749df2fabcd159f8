# After the README's run: every file that it names is there, and its evaluate allows for the errors of the ground truth.
for file in trajectory_kitti.txt trajectory_tum.txt trajectory_online.txt covariances.csv timing.csv loops.csv map.ply cameras.yaml run.yaml \
  report.html; do
  [ -s "OUT/$file" ] || { echo "no $file" >&2; exit 1; }
done
grep -q 'NEES over 10 frames' block.out
if grep 'hint:' block.out; then exit 1; fi
