# The object is complete, and its members are those of the table in docs/datasets.md.
for member in stereo_slam dataset format preset output state error frames frames_lost frames_by_status weak_frames_by_reason unreadable_images right_image_misfits right_image_displacement_px right_camera_turns keyframes landmarks \
  loops_accepted loops_refused path_m last_sigma_m last_sigma_deg seconds frames_per_second frame peak_memory_mb; do
  grep -q "^  \"$member\": " run.json
  grep -q "\`$member\`" "$SOURCE_DIR/docs/datasets.md"
done
grep -q '"state": "finished"' run.json
if python3 --version >/dev/null 2>&1; then
  python3 -c 'import json; run = json.load(open("run.json")); assert run["frames"] == 30 and run["path_m"] > 1.0, run'
fi
