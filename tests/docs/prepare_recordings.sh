#!/usr/bin/env bash
# Renders and runs what the commands of the documentation work on, under the names that it uses.
#
#   prepare_recordings.sh STEREO_SLAM OUTPUT_DIR MAKE_VIDEOS MAKE_BAG
set -euo pipefail
program=$1
rm -rf "$2"
mkdir -p "$2"
cd "$2"

"$program" simulate --quiet --output DIR --frames 30 --scale 0.35
"$program" simulate --quiet --output V1_01_easy --frames 3 --format euroc
"$program" simulate --quiet --output RECTIFIED --frames 2
"$program" run --quiet --dataset DIR --output OUT --save-map map
cp -r OUT out
cp -r DIR MONDAY
cp -r DIR TUESDAY
cp DIR/poses.txt poses.txt
cp DIR/poses.txt POSES
echo "seed: 2" >FILE.yaml

# Raw images and Kalibr's calibration of them; videos, and the calibration of their rectified images.
mkdir RAW
cp -r V1_01_easy/mav0/cam0/data RAW/left
cp -r V1_01_easy/mav0/cam1/data RAW/right
{
  echo "cam0:"
  grep -E '^(resolution|intrinsics|distortion_model|distortion_coefficients):' V1_01_easy/mav0/cam0/sensor.yaml | sed 's/^/  /'
  sed -n '/^T_BS/,/]/p' V1_01_easy/mav0/cam0/sensor.yaml | sed 's/^/  /'
  echo "cam1:"
  grep -E '^(resolution|intrinsics|distortion_model|distortion_coefficients):' V1_01_easy/mav0/cam1/sensor.yaml | sed 's/^/  /'
  sed -n '/^T_BS/,/]/p' V1_01_easy/mav0/cam1/sensor.yaml | sed 's/^/  /'
} >camchain.yaml
"$3" RECTIFIED .
"$4" DIR BAG
