// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <set>
#include <sqlite3.h>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/bags/message_file.hpp"
#include "stereo_slam/io/counted.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kDatabaseAdvice =
    "copy or download the bag again, or try sqlite3's command .recover";

/// The name of a file as SQLite reads it from a URI.
[[nodiscard]] std::string uri_of(const fs::path& file) {
  std::string uri = "file:";
  for (const char c : fs::absolute(file).string()) {
    if (c == '%' || c == '?' || c == '#') {
      uri += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    } else {
      uri += c;
    }
  }
  // A recording that was not ended may have its last messages in a second file, which SQLite merges; all
  // others are read without locks, also where the folder cannot be written.
  return fs::exists(file.string() + "-wal") ? uri : uri + "?immutable=1";
}

/// Whether the file has fewer pages than its header says. With a log beside it the header need not be right.
[[nodiscard]] bool is_cut_off(const fs::path& file) {
  constexpr std::size_t kHeader_bytes = 100;  // https://www.sqlite.org/fileformat.html
  std::array<std::uint8_t, kHeader_bytes> header{};
  std::ifstream stream(file, std::ios::binary);
  if (!stream.read(reinterpret_cast<char*>(header.data()), header.size())) return false;
  if (fs::exists(file.string() + "-wal")) return false;
  const auto number = [&](std::size_t at, std::size_t bytes) {
    return std::accumulate(header.begin() + static_cast<std::ptrdiff_t>(at),
                           header.begin() + static_cast<std::ptrdiff_t>(at + bytes), std::uint64_t{0},
                           [](std::uint64_t value, std::uint8_t byte) { return 256 * value + byte; });
  };
  const std::uint64_t page_bytes = number(16, 2) == 1 ? 65536 : number(16, 2);
  const bool counts_pages = number(24, 4) == number(92, 4);  // written by a version of SQLite that does
  return counts_pages && page_bytes * number(28, 4) > fs::file_size(file);
}

/// A bag in a database of SQLite: the tables topics and messages. The offset of a place is the row of its
/// message.
class Db3File : public MessageFile {
 public:
  explicit Db3File(const fs::path& file) {
    sqlite3* opened = nullptr;
    // Like any MessageFile it is not thread-safe, so that SQLite needs no locks.
    constexpr int kFlags = SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX;
    const int status = sqlite3_open_v2(uri_of(file).c_str(), &opened, kFlags, nullptr);
    database_.reset(opened);
    if (status != SQLITE_OK) refuse("cannot be opened");
    // SQLite reads what is left of a file that was cut off only if the schema may be written, which a
    // connection for reading does not do.
    sqlite3_exec(opened, "PRAGMA writable_schema=ON", nullptr, nullptr, nullptr);
    read_topics();
    read_places(is_cut_off(file));
  }

  [[nodiscard]] std::vector<BagTopic> topics() override {
    std::vector<BagTopic> topics;
    for (const auto& [id, topic] : topics_) {
      topics.push_back(topic);
      topics.back().messages = places_[id].size();
    }
    return topics;
  }

  [[nodiscard]] std::optional<RecordTimes> times() override { return times_; }

  [[nodiscard]] std::vector<MessagePlace> places(const std::string& topic) override {
    std::vector<MessagePlace> places;
    for (const auto& [id, known] : topics_) {
      if (known.name == topic) places.insert(places.end(), places_[id].begin(), places_[id].end());
    }
    return places;
  }

  [[nodiscard]] std::span<const std::uint8_t> read(const MessagePlace& place) override {
    if (const auto fault = try_to_read(place, std::numeric_limits<std::size_t>::max()); !fault.empty())
      throw std::runtime_error(fault);
    return bytes_;
  }

  [[nodiscard]] std::vector<MessageBeginning> read_beginnings(std::span<const MessagePlace> places) override {
    std::vector<MessageBeginning> beginnings(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      beginnings[i].fault = try_to_read(places[i], kStampedBytes);
      if (beginnings[i].fault.empty()) fill_beginning(beginnings[i], [&] { return std::span(bytes_); });
    }
    return beginnings;
  }

  void release() override {
    blob_.reset();
    bytes_ = {};
    sqlite3_db_release_memory(database_.get());
  }

  [[nodiscard]] std::string warning() const override { return warning_; }

 private:
  struct Close {
    void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
    void operator()(sqlite3_blob* blob) const { sqlite3_blob_close(blob); }
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Close>;

  /// Reads the message, or its first `most_bytes`. Returns why that is not possible; nothing if it is. In a
  /// damaged database that may hold for most messages, and exceptions would take most of the time.
  [[nodiscard]] std::string try_to_read(const MessagePlace& place, std::size_t most_bytes) {
    const auto row = static_cast<sqlite3_int64>(place.offset);
    sqlite3_blob* blob = blob_.get();
    const int status = blob != nullptr
                           ? sqlite3_blob_reopen(blob, row)
                           : sqlite3_blob_open(database_.get(), "main", "messages", "data", row, 0, &blob);
    if (blob_ == nullptr) blob_.reset(blob);
    if (status == SQLITE_OK) {
      bytes_.resize(std::min(most_bytes, static_cast<std::size_t>(sqlite3_blob_bytes(blob))));
      if (sqlite3_blob_read(blob, bytes_.data(), static_cast<int>(bytes_.size()), 0) == SQLITE_OK) return {};
    }
    std::string why = sqlite3_errmsg(database_.get());
    blob_.reset();  // it cannot be used again
    return fmt::format("the message cannot be read ({}); {}", why, kDatabaseAdvice);
  }

  [[noreturn]] void refuse(std::string_view what) const {
    const std::string why = sqlite3_errmsg(database_.get());
    throw std::runtime_error(fmt::format("the database {} ({}); {}", what, why, kDatabaseAdvice));
  }

  [[nodiscard]] Statement prepare(const char* query) const {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), query, -1, &statement, nullptr) != SQLITE_OK)
      refuse("is damaged, or no bag of ROS 2");
    return Statement(statement);
  }

  void read_topics() {
    const Statement query = prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY name");
    const auto text = [&](int column) {
      const auto* bytes = static_cast<const char*>(sqlite3_column_blob(query.get(), column));
      return bytes == nullptr
                 ? std::string()
                 : std::string(bytes, static_cast<std::size_t>(sqlite3_column_bytes(query.get(), column)));
    };
    std::set<std::int64_t> known;
    int status = SQLITE_OK;
    while ((status = sqlite3_step(query.get())) == SQLITE_ROW) {
      const std::int64_t id = sqlite3_column_int64(query.get(), 0);
      if (!known.insert(id).second) continue;  // a damaged database may have a row many times
      topics_.emplace_back(
          id, BagTopic{.name = text(1), .type = text(2), .messages = 0, .serialization = text(3)});
    }
    if (status != SQLITE_DONE) refuse("is damaged");
  }

  /// Reads where the messages are, without these. Of a damaged database, as many as can be read.
  void read_places(bool is_cut) {
    const Statement query =
        prepare("SELECT rowid, topic_id, timestamp FROM messages NOT INDEXED ORDER BY rowid");
    std::size_t count = 0;
    int status = SQLITE_OK;
    while ((status = sqlite3_step(query.get())) == SQLITE_ROW) {
      const std::int64_t record_ns = sqlite3_column_int64(query.get(), 2);
      places_[sqlite3_column_int64(query.get(), 1)].push_back(
          {.record_ns = record_ns,
           .block = 0,
           .offset = static_cast<std::uint64_t>(sqlite3_column_int64(query.get(), 0))});
      if (!times_) times_ = RecordTimes{record_ns, record_ns};
      times_->first_ns = std::min(times_->first_ns, record_ns);
      times_->last_ns = std::max(times_->last_ns, record_ns);
      ++count;
    }
    if (status == SQLITE_DONE && !is_cut) return;
    if (status != SQLITE_DONE && count == 0) refuse("is damaged");
    warning_ = fmt::format(
        "the database is damaged ({}): {} at its beginning can be read, and later ones are missing",
        is_cut ? "it was cut off" : sqlite3_errmsg(database_.get()), counted(count, "message"));
  }

  std::unique_ptr<sqlite3, Close> database_;
  std::unique_ptr<sqlite3_blob, Close> blob_;  ///< of the last message; closed before the database
  std::vector<std::pair<std::int64_t, BagTopic>> topics_;
  std::map<std::int64_t, std::vector<MessagePlace>> places_;  ///< by topic
  std::optional<RecordTimes> times_;
  std::string warning_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace

std::unique_ptr<MessageFile> open_db3_file(const fs::path& file) { return std::make_unique<Db3File>(file); }

}  // namespace stereo_slam
