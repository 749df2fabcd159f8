// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <memory>
#include <sqlite3.h>
#include <stdexcept>
#include <zstd.h>

#include "stereo_slam/support/recorded_drive.hpp"

namespace stereo_slam::test {

/// Packs bytes by zstd.
template <class Bytes>
Bytes zstd_of(const Bytes& bytes) {
  Bytes packed;
  packed.resize(ZSTD_compressBound(bytes.size()));
  packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1));
  return packed;
}

/// Writes messages as rosbag2's plugin sqlite3 does.
inline void write_db3(const fs::path& file, const std::vector<TestMessage>& messages,
                      bool packs_messages = false, const std::string& encoding = "cdr") {
  const auto require = [](bool done) {
    if (!done) throw std::runtime_error("the test cannot write its database");
  };
  sqlite3* opened = nullptr;
  require(sqlite3_open(file.c_str(), &opened) == SQLITE_OK);
  const std::unique_ptr<sqlite3, int (*)(sqlite3*)> database(opened, sqlite3_close);
  const auto execute = [&](const std::string& sql) {
    require(sqlite3_exec(opened, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
  };
  execute(
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
      "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
      "data BLOB NOT NULL); CREATE INDEX timestamp_idx ON messages (timestamp ASC); BEGIN");
  std::map<std::string, std::size_t> topics;
  for (const auto& message : messages) {
    const auto [topic, is_new] = topics.try_emplace(message.topic, topics.size() + 1);
    if (is_new)
      execute(fmt::format("INSERT INTO topics VALUES({}, '{}', '{}', '{}', '')", topic->second, message.topic,
                          message.type, encoding));
    sqlite3_stmt* statement = nullptr;
    const std::string sql = fmt::format("INSERT INTO messages (topic_id, timestamp, data) VALUES({}, {}, ?)",
                                        topic->second, message.record_ns);
    require(sqlite3_prepare_v2(opened, sql.c_str(), -1, &statement, nullptr) == SQLITE_OK);
    const auto bytes = packs_messages ? zstd_of(message.bytes) : message.bytes;
    sqlite3_bind_blob(statement, 1, bytes.data(), static_cast<int>(bytes.size()), nullptr);
    require(sqlite3_step(statement) == SQLITE_DONE);
    sqlite3_finalize(statement);
  }
  execute("COMMIT");
}

}  // namespace stereo_slam::test
