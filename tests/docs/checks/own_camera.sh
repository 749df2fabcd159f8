# The members and lines that the guide tells readers to look at are there.
for member in frames_lost last_sigma_m loops_accepted p95_ms; do
  grep -q "\"$member\": " run.json
done
stereo_slam info --dataset RAW --calibration camchain.yaml >info.txt
for line in verdict 'stereo check .* matches, row offset .* px, disparity' duration 'rectified .* turned by' baseline; do
  grep -q "^$line" info.txt
done
