# After cpack: three packages that dpkg can read.
for package in libantipode-dev libstereo-slam-dev stereo-slam; do
  dpkg-deb --info packages/${package}_*.deb
done
