# A calibration is accepted with two folders of images such as it describes: raw ones of its size, or rectified ones.
mkdir rig
cp block.yaml rig/calibration.yaml
if grep -q '^rectified:' block.yaml; then
  cp -r RECTIFIED/image_0 rig/cam_left
  cp -r RECTIFIED/image_1 rig/cam_right
else
  cp -r V1_01_easy/mav0/cam0/data rig/left
  cp -r V1_01_easy/mav0/cam1/data rig/right
fi
stereo_slam info --dataset rig
