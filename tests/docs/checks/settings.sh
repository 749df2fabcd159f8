# A block of settings is accepted as one.
stereo_slam run --quiet --dataset DIR --output SETTINGS --config block.yaml --max-frames 2
