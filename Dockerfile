# stereo_slam in a container:
#   docker build --target program -t stereo_slam .     a small image with the program; `docker run --rm -v "$PWD:/data" stereo_slam run ...`
#   docker build --target demo .                       the demo of README.md, as a check
#   docker build --target test .                       all tests, as a check
FROM debian:12-slim AS source
WORKDIR /antipode
COPY cmake/install-dependencies.sh cmake/
RUN cmake/install-dependencies.sh
COPY . .

FROM source AS demo
RUN examples/stereo_slam/demo.sh

FROM source AS test
RUN tests/run.sh

FROM source AS packages
RUN cmake -S . -B build/package -G Ninja -D CMAKE_BUILD_TYPE=Release -D CMAKE_POSITION_INDEPENDENT_CODE=ON -D ANTIPODE_BUILD_TESTS=OFF \
    && cmake --build build/package \
    && cpack --config build/package/CPackConfig.cmake -B packages

FROM debian:12-slim AS program
COPY --from=packages /antipode/packages/stereo-slam_*.deb /tmp/
RUN apt-get update && apt-get install -y --no-install-recommends /tmp/stereo-slam_*.deb \
    && rm -rf /var/lib/apt/lists/* /tmp/*.deb
WORKDIR /data
ENTRYPOINT ["stereo_slam"]
