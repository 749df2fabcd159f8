"""Writes bags for bag_recording_test.cpp with ROS's own Python implementation: write_bags.py FOLDER

The images are those of FOLDER/left and FOLDER/right: PNGs of the tiny recording (320 x 120, baseline 0.4 m).
Status 77 if ROS is not installed.
"""
import glob
import struct
import sys
import zlib

try:
    import genpy
    import rosbag
    from sensor_msgs.msg import CameraInfo, CompressedImage, Image, Imu
    from std_msgs.msg import String
except ImportError:
    sys.exit(77)

folder = sys.argv[1]
FIRST_NS = 1_500_000_000_000_000_000


def stamp(frame, offset_ns=0):
    total = FIRST_NS + 100_000_000 * frame + offset_ns
    return genpy.Time(total // 10**9, total % 10**9)


def frames(side):
    return sorted(glob.glob(f"{folder}/{side}/*.png"))


def grey(path):
    """Rows of a grey PGM beside the PNG."""
    with open(path.replace(".png", ".pgm"), "rb") as file:
        data = file.read()
    return data[-320 * 120:]


def image(path, when, encoding="mono8"):
    pixels = grey(path)
    message = Image(width=320, height=120, encoding=encoding, step=320)
    if encoding == "mono16":
        pixels = b"".join(bytes([7, value]) for value in pixels)
        message.step = 640
    elif encoding == "12 bits":
        pixels = b"".join((16 * value + 7).to_bytes(2, "little") for value in pixels)
        message.encoding = "mono16"
        message.step = 640
    elif encoding == "rgb16":
        pixels = b"".join(bytes([7, value] * 3) for value in pixels)
        message.step = 1920
    elif encoding in ("rgb8", "8UC3"):
        pixels = b"".join(bytes([value] * 3) for value in pixels)
        message.step = 960
    message.data = pixels
    message.header.stamp = when
    return message


def compressed(path, when):
    with open(path, "rb") as file:
        message = CompressedImage(format="mono8; png compressed", data=file.read())
    message.header.stamp = when
    return message


def compressed_12_bits(path, when):
    """A grey PNG of 16 bits a pixel, as a camera of 12 bits fills it."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    pixels = b"".join((16 * value + 7).to_bytes(2, "big") for value in grey(path))
    rows = b"".join(b"\0" + pixels[640 * row:640 * (row + 1)] for row in range(120))
    header = struct.pack(">IIBBBBB", 320, 120, 16, 0, 0, 0, 0)
    png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    message = CompressedImage(format="16UC1; png compressed", data=png)
    message.header.stamp = when
    return message


def camera_info(side, baseline=0.4):
    message = CameraInfo(width=320, height=120, distortion_model="plumb_bob", D=[0.0] * 5)
    message.K = [200.0, 0, 160, 0, 200, 60, 0, 0, 1]
    message.R = [1.0, 0, 0, 0, 1, 0, 0, 0, 1]
    message.P = [200.0, 0, 160, 0 if side == "left" else -200 * baseline, 0, 200, 60, 0, 0, 0, 1, 0]
    return message


def changed_projection(wanted_side, element, value):
    """Infos in which one element of P of one camera has another value."""
    def info(side):
        message = camera_info(side)
        if side == wanted_side:
            message.P = [value if i == element else number for i, number in enumerate(message.P)]
        return message

    return info


def uncalibrated(messages):
    """Infos of which so many of each camera have a K of zeros, as drivers send them before a calibration."""
    sent = {"left": 0, "right": 0}

    def info(side):
        sent[side] += 1
        message = camera_info(side)
        return CameraInfo(width=320, height=120) if sent[side] <= messages else message

    return info


def bare(side):
    """Of rectified images, without what these do not need."""
    return CameraInfo(width=320, height=120, K=camera_info(side).K, P=camera_info(side).P)


def half(path, when):
    """An image of every second pixel of every second row."""
    message = image(path, when)
    message.data = b"".join(message.data[320 * row:320 * (row + 1)][::2] for row in range(0, 120, 2))
    message.width, message.height, message.step = 160, 60, 160
    return message


def strange_lens(side):
    message = camera_info(side)
    message.distortion_model = "unheard_of" if side == "right" else "plumb_bob"
    return message


def wider(path, when):
    """An image with an empty column in addition."""
    message = image(path, when)
    pixels = bytes(message.data)
    step = len(pixels) // message.height
    message.data = b"".join(pixels[step * row:step * (row + 1)] + b"\0" for row in range(message.height))
    message.width, message.step = message.width + 1, step + 1
    return message


def side_by_side(path, when):
    """The left and the right image in one."""
    message = image(path, when)
    left = bytes(message.data)
    right = grey(path.replace("/left/", "/right/"))
    message.data = b"".join(left[320 * row:320 * (row + 1)] + right[320 * row:320 * (row + 1)] for row in range(120))
    message.width, message.step = 640, 640
    return message


def with_stamp(seconds, wanted_frame=None):
    """Images of which all, or that of one frame, have another stamp."""
    def make(path, when):
        message = image(path, when)
        if wanted_frame is None or path.endswith(f"{wanted_frame:06}.png"):
            message.header.stamp = genpy.Time(seconds, 0)
        return message

    return make


def write(name, topics, make=image, info=camera_info, compression="none", skip=None, taken=lambda frame: frame,
          recorded=range(1000)):
    """`topics` by side; images are recorded later than they were taken, the right ones first. `taken` is the
    frame whose stamp a frame has; only the frames `recorded` are written."""
    with rosbag.Bag(f"{folder}/{name}", "w", compression=compression) as bag:
        bag.write("/note", String("hello"), stamp(recorded[0]))
        for frame, (left, right) in enumerate(zip(frames("left"), frames("right"))):
            for side, path in (("right", right), ("left", left)):
                if skip == (side, frame) or frame not in recorded or side not in topics:
                    continue
                offset_ns = 400_000 if side == "right" else 0
                bag.write(topics[side], make(path, stamp(taken(frame), offset_ns)), stamp(frame, 30_000_000))
                if info:
                    base = topics[side].replace("/compressed", "").rsplit("/", 1)[0]
                    bag.write(base + "/camera_info", info(side), stamp(frame, 30_000_000))


stereo = {"left": "/stereo/left/image_raw", "right": "/stereo/right/image_raw"}
write("stereo.bag", stereo)
write("compressed.bag", {side: topic + "/compressed" for side, topic in stereo.items()}, compressed, compression="bz2")
write("lz4.bag", stereo, lambda path, when: image(path, when, "mono16"), compression="lz4")
write("dark.bag", stereo, lambda path, when: image(path, when, "12 bits"))
write("dark_png.bag", {side: topic + "/compressed" for side, topic in stereo.items()}, compressed_12_bits)
write("rgb.bag", {"left": "/a/left/image_rect", "right": "/a/right/image_rect"}, lambda path, when: image(path, when, "rgb8"))
rectified = {"left": "/a/left/image_rect", "right": "/a/right/image_rect"}
write("half.bag", rectified, half)
write("direct.bag", {"left": "/direct/left/image_raw", "right": "/direct/right/image_raw"})
write("euroc.bag", {"left": "/cam0/image_raw", "right": "/cam1/image_raw"}, info=None)
write("odd.bag", {"left": "/front", "right": "/back"}, info=None)
write("gap.bag", stereo, skip=("right", 2))
write("back.bag", stereo, taken=lambda frame: frame if frame < 3 else frame - 2)
write("repeated.bag", stereo, taken=lambda frame: 1 if frame == 2 else frame)
write("swapped.bag", stereo, info=lambda side: camera_info("right" if side == "left" else "left"))
write("fisheye.bag", stereo, info=strange_lens)
write("wider.bag", stereo, lambda path, when: wider(path, when) if "right" in path and path.endswith("3.png") else image(path, when))
write("strange.bag", stereo, lambda path, when: image(path, when, "32FC1"))
write("uncalibrated_first.bag", stereo, info=uncalibrated(2))
write("uncalibrated.bag", stereo, info=uncalibrated(1000))
write("bare_rectified.bag", rectified, info=bare)
write("bare_raw.bag", stereo, info=bare)
for name, topics in (("rect", rectified), ("raw", stereo)):
    write(f"{name}_positive.bag", topics, info=lambda side: camera_info(side, baseline=-0.4))
    write(f"{name}_cx.bag", topics, info=changed_projection("right", 2, 180.0))
    write(f"{name}_fx.bag", topics, info=changed_projection("left", 0, 210.0))
    write(f"{name}_cy.bag", topics, info=changed_projection("right", 6, 70.0))
    write(f"{name}_Ty.bag", topics, info=changed_projection("right", 7, -80.0))
    write(f"{name}_both.bag", topics, info=changed_projection("left", 3, -40.0))
write("zero.bag", stereo, with_stamp(0))
write("outlier.bag", stereo, with_stamp(9_000_000_000 % 2**32, 2))
write("first_zero.bag", stereo, with_stamp(0, 0))
write("last_late.bag", stereo, with_stamp(1_600_000_000, 4))
write("8uc3.bag", stereo, lambda path, when: image(path, when, "8UC3"))
write("rgb16.bag", stereo, lambda path, when: image(path, when, "rgb16"))
write("both.bag", {"left": "/zed/image"}, side_by_side)
write("part_0.bag", stereo, recorded=range(0, 2))
write("part_1.bag", stereo, recorded=range(2, 5))
write("reversed.bag", {"left": "/cam_b/image", "right": "/cam_a/image"})
write("unnamed.bag", {"left": "/other/image", "right": "/main/image"})
write("unnamed_without.bag", {"left": "/other/image", "right": "/main/image"},
      info=lambda side: CameraInfo(width=320, height=120))
write("counted.bag", {"left": "/drive/Cam_2/image", "right": "/drive/Cam_3/image"})

with rosbag.Bag(f"{folder}/stereo.bag") as images, rosbag.Bag(f"{folder}/imu.bag", "w") as bag:
    for topic, message, when in images.read_messages():
        bag.write(topic, message, when)
    for i in range(100):  # at 200 Hz, as imu_bag_test.cpp expects them
        reading = Imu()
        reading.header.stamp = stamp(0, 5_000_000 * i)
        reading.angular_velocity.x, reading.angular_velocity.z = 0.1, 0.001 * (i % 7)
        reading.linear_acceleration.y, reading.linear_acceleration.z = -0.01 * (i % 5), 9.81
        bag.write("/imu0", reading, stamp(0, 5_000_000 * i + 1_000_000))
