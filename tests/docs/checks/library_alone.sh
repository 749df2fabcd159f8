# After the installation of the library alone: headers and package files are there.
[ -f PREFIX/include/antipode/antipode.hpp ]
[ -f PREFIX/share/cmake/antipode/antipode-config.cmake ]
