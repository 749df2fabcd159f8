"""Writes the databases of this folder from its MCAP files: python3 write_db3.py [FOLDER]

Python's sqlite3 writes the tables as rosbag2's plugin does, and the program zstd packs. The messages are those
of unchunked.mcap, which other programs serialised; a file without chunks is read here in twenty lines.
"""
import pathlib
import sqlite3
import struct
import subprocess
import sys

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")


def text(content, at):
    length = struct.unpack_from("<I", content, at)[0]
    return content[at + 4:at + 4 + length].decode(), at + 4 + length


def read_mcap(data):
    """Topics as id: (name, type), and messages as (id, time, bytes)."""
    schemas, topics, messages = {}, {}, []
    at = 8
    while data[at] != 0x0F:  # the end of the data
        length = struct.unpack_from("<Q", data, at + 1)[0]
        content = data[at + 9:at + 9 + length]
        if data[at] == 0x03:
            schemas[struct.unpack_from("<H", content)[0]] = text(content, 2)[0]
        elif data[at] == 0x04:
            channel, schema = struct.unpack_from("<HH", content)
            topics[channel] = (text(content, 4)[0], schemas[schema])
        elif data[at] == 0x05:
            channel, _, log_ns = struct.unpack_from("<HIQ", content)
            messages.append((channel, log_ns, content[22:]))
        at += 9 + length
    return topics, messages


def zstd(data):
    return subprocess.run(["zstd", "-q", "-c"], input=data, stdout=subprocess.PIPE, check=True).stdout


def write(name, topics, messages, pack=lambda data: data):
    file = folder / name
    file.unlink(missing_ok=True)
    with sqlite3.connect(file, isolation_level=None) as database:
        database.execute("PRAGMA page_size=512")
        database.execute("CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL)")
        database.execute("INSERT INTO schema VALUES(4, 'jazzy')")
        database.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
                         "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL, "
                         "type_description_hash TEXT NOT NULL)")
        database.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, "
                         "timestamp INTEGER NOT NULL, data BLOB NOT NULL)")
        database.execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
        for topic, (topic_name, kind) in topics.items():
            database.execute("INSERT INTO topics VALUES(?, ?, ?, 'cdr', '', '')", (topic, topic_name, kind))
        for topic, time, data in messages:
            database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", (topic, time, pack(data)))
    database.close()
    return file


drive = read_mcap((folder / "unchunked.mcap").read_bytes())
write("packed_messages.db3", *drive, zstd)
plain = write("plain.db3", *drive)
(folder / "packed.db3.zstd").write_bytes(zstd(plain.read_bytes()))
(folder / "packed.mcap.zstd").write_bytes(zstd((folder / "none.mcap").read_bytes()))
