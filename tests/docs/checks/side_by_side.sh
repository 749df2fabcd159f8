# A calibration of images side by side is accepted with the video that it names.
mkdir rig
cp block.yaml rig/calibration.yaml
cp both.avi rig
stereo_slam info --dataset rig | grep 'format        video'
