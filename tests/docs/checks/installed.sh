# After the README's installation: the program runs from where it was put.
"$HOME/.local/bin/stereo_slam" --version
