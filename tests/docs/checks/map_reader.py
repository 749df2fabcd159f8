
# The reader has read what stereo_slam wrote.
assert len(landmarks) > 100, len(landmarks)
assert keyframes and all(corners for *_, corners in keyframes)
assert keyframes[0][0] == 0, keyframes[0][0]
