# The file is complete, and has the topics of the table in docs/guides/ros2_robot.md.
[ "$(head -c 8 poses.mcap | tail -c 7 | tr -d '\r\n')" = "MCAP0" ]
[ "$(tail -c 8 poses.mcap | tail -c 7 | tr -d '\r\n')" = "MCAP0" ]
stereo_slam info --dataset poses.mcap >topics.txt 2>/dev/null || true # it has no pair of cameras
for topic in /stereo_slam/odometry /stereo_slam/pose /tf /tf_static /stereo_slam/path /stereo_slam/landmarks /stereo_slam/map /diagnostics \
  /stereo_slam/left/compressed; do
  grep -q "^topic  *$topic " topics.txt
  grep -q "\`$topic\`" "$SOURCE_DIR/docs/guides/ros2_robot.md"
done
