
#include <fmt/format.h>
#include <sqlite3.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "problems/common/error.h"
#include "problems/import/formats/bytes.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/formats/ros_decoder.h"
#include "problems/log/decompress.h"
#include "problems/log/unpacked.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxMessage = 1ULL << 28;  // bytes, uncompressed

class SqliteRows {
 public:
  SqliteRows(sqlite3* database, const char* query) {
    sqlite3_prepare_v2(database, query, -1, &statement_, nullptr);
  }
  ~SqliteRows() { sqlite3_finalize(statement_); }
  SqliteRows(const SqliteRows&) = delete;
  SqliteRows& operator=(const SqliteRows&) = delete;

  // False at the end, for damage, and if the query does not fit the database.
  bool Next() {
    result_ = statement_ == nullptr ? SQLITE_ERROR : sqlite3_step(statement_);
    return result_ == SQLITE_ROW;
  }
  bool AtEnd() const { return result_ == SQLITE_DONE; }
  std::int64_t Whole(int column) const { return sqlite3_column_int64(statement_, column); }
  std::string_view Bytes(int column) const {  // valid until Next()
    const auto* bytes = static_cast<const char*>(sqlite3_column_blob(statement_, column));
    const int size = sqlite3_column_bytes(statement_, column);
    return bytes == nullptr ? std::string_view()
                            : std::string_view(bytes, static_cast<std::size_t>(size));
  }
  std::string Text(int column) const { return std::string(Bytes(column)); }

 private:
  sqlite3_stmt* statement_ = nullptr;
  int result_ = SQLITE_ERROR;
};

// Neither locks anything, and no file appears beside the bag.
constexpr char kWithoutWal[] = "immutable=1";
constexpr char kWithWal[] = "vfs=unix-none";  // of an exclusive connection

std::string SqliteUri(const fs::path& path, const char* options) {
  std::string uri = "file:";
  for (const char c : fs::absolute(path).string()) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '/' || c == '.' ||
                       c == '_' || c == '-';
    uri += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return uri + "?" + options;
}

// Holds the last rows of a bag whose recorder was killed, until SQLite moves them into the bag.
fs::path WalOf(const fs::path& path) { return path.string() + "-wal"; }

bool HasWal(const fs::path& path) {
  std::error_code missing;
  const std::uintmax_t size = fs::file_size(WalOf(path), missing);
  return !missing && size > 0;
}

// SQLite takes a log with another start for an empty one.
bool IsWal(const fs::path& wal) {
  const std::string magic = FirstBytes(wal, 4);
  return magic == "\x37\x7f\x06\x82" || magic == "\x37\x7f\x06\x83";
}

class SqliteBag {
 public:
  SqliteBag(const fs::path& path, MessageSink* sink) : path_(path), sink_(sink) {
    if (HasWal(path) && OpenWithWal()) return;
    if (Open(kWithoutWal)) return;
    Close();
    throw ErrorAt(path.string(), 0, "cannot be opened as an sqlite3 file; copy it again");
  }
  ~SqliteBag() { Close(); }
  SqliteBag(const SqliteBag&) = delete;
  SqliteBag& operator=(const SqliteBag&) = delete;

  void Run() {
    ReadDefinitions();
    ReadTopics();
    SqliteRows rows(database_, "SELECT topic_id, timestamp, data FROM messages ORDER BY rowid");
    std::string decompressed;
    std::size_t read = 0, left_out = 0;
    for (; rows.Next(); ++read) {
      const auto channel = channels_.find(rows.Whole(0));
      std::string_view data = rows.Bytes(2);
      bool good = channel != channels_.end();
      if (good && data.starts_with(kZstdMagic)) {
        good = Decompress("zstd", data, kMaxMessage, &decompressed);
        data = decompressed;
      }
      if (good) {
        sink_->Add(channel->second, rows.Whole(1), data);
      } else {
        ++left_out;
      }
    }
    if (!rows.AtEnd()) {
      sink_->Warn(fmt::format("{}: is damaged after {} messages ({}); the rest is left out",
                              path_.filename().string(), read, sqlite3_errmsg(database_)));
    }
    if (left_out > 0) {
      sink_->Warn(fmt::format("{}: {} messages of unknown topics, or damaged, are left out",
                              path_.filename().string(), left_out));
    }
  }

 private:
  bool Open(const char* options) {
    return sqlite3_open_v2(SqliteUri(Unpacked(path_), options).c_str(), &database_,
                           SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr) == SQLITE_OK;
  }

  // An exclusive connection keeps the index of the write-ahead log in memory instead of in a file
  // beside the bag, and leaves the log as it is when it is closed.
  bool OpenWithWal() {
    const bool good =
        IsWal(WalOf(path_)) && Open(kWithWal) &&
        sqlite3_db_config(database_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr) == SQLITE_OK &&
        Execute("PRAGMA locking_mode=EXCLUSIVE") && Execute("SELECT count(*) FROM sqlite_master");
    if (good) return true;
    const std::string name = path_.filename().string();
    sink_->Warn(fmt::format(
        "{0}-wal, the write-ahead log of {0}, can't be read ({1}), so the last rows are missing; "
        "copy both files again, or run: sqlite3 {0} 'PRAGMA wal_checkpoint(TRUNCATE)'",
        name, database_ == nullptr ? "its start is damaged" : sqlite3_errmsg(database_)));
    Close();
    return false;
  }

  bool Execute(const char* query) {
    return sqlite3_exec(database_, query, nullptr, nullptr, nullptr) == SQLITE_OK;
  }

  void Close() {
    sqlite3_close(database_);
    database_ = nullptr;
  }

  // From schema 4 on.
  void ReadDefinitions() {
    SqliteRows rows(database_,
                    "SELECT topic_type, encoded_message_definition FROM message_definitions "
                    "WHERE encoding = 'ros2msg'");
    while (rows.Next()) definitions_[rows.Text(0)] = rows.Text(1);
  }

  void ReadTopics() {
    SqliteRows rows(database_, "SELECT id, name, type, serialization_format FROM topics");
    while (rows.Next()) {
      const std::string type = rows.Text(2);
      const bool cdr = rows.Text(3) == "cdr";
      const std::string& definition = definitions_[type];
      const ChannelKey key{rows.Text(1), 0, type, rows.Text(3) + " " + RosLayout(type, definition)};
      channels_[rows.Whole(0)] = sink_->AddChannel(key, [&]() -> std::unique_ptr<MessageDecoder> {
        return cdr ? MakeCdrDecoder(type, definition) : nullptr;
      });
    }
    if (!rows.AtEnd() && sqlite3_errcode(database_) != SQLITE_ERROR) {
      const std::string name = path_.filename().string();
      throw ErrorAt(path_.string(), 0,
                    fmt::format("is a cut or damaged sqlite3 file ({}), so its ROS 2 bag can't be "
                                "read; copy it again, or save what is left by: sqlite3 {} "
                                ".recover | sqlite3 recovered.db3",
                                sqlite3_errmsg(database_), name));
    }
    if (!rows.AtEnd()) {
      throw ErrorAt(path_.string(), 0,
                    "is an sqlite3 file without the tables of a ROS 2 bag; give a bag");
    }
  }

  fs::path path_;
  MessageSink* sink_;
  sqlite3* database_ = nullptr;
  std::map<std::string, std::string> definitions_;  // by type
  std::map<std::int64_t, std::size_t> channels_;    // by topic
};

void WalkBagFile(const fs::path& path, MessageSink* sink) {
  const std::string magic = FirstBytes(path, 16);
  if (magic.starts_with("SQLite format 3")) return SqliteBag(path, sink).Run();
  if (magic.starts_with("\x89MCAP0\r\n")) return WalkMcap(path, sink);
  throw ErrorAt(path.string(), 0, "is neither an sqlite3 nor an MCAP file; give a ROS 2 bag");
}

bool IsBagFile(const fs::path& path) {
  const std::string name = path.filename().string();
  for (const char* ending : {".db3", ".mcap", ".db3.zstd", ".mcap.zstd"}) {
    if (name.ends_with(ending)) return true;
  }
  return false;
}

// `relative_file_paths` of metadata.yaml, whether they exist or not; old versions put the folder's
// name before.
std::vector<fs::path> ListedFiles(const fs::path& folder) {
  std::vector<fs::path> files;
  try {
    const YAML::Node information =
        YAML::LoadFile((folder / "metadata.yaml").string())["rosbag2_bagfile_information"];
    for (const YAML::Node& listed : information["relative_file_paths"]) {
      const fs::path name = listed.as<std::string>();
      const fs::path inside = folder / name;
      files.push_back(fs::exists(inside) ? inside : folder / name.filename());
    }
  } catch (const YAML::Exception&) {
    return {};
  }
  return files;
}

bool IsMissing(const fs::path& file) { return !fs::is_regular_file(file); }

// Bag files of the folder that are not read, but for decompressed copies of those that are.
void WarnOfUnlisted(const fs::path& folder, const std::vector<fs::path>& read, MessageSink* sink) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!entry.is_regular_file() || !IsBagFile(name)) continue;
    const bool is_read = std::any_of(read.begin(), read.end(), [&](const fs::path& file) {
      return file.filename() == name || file.filename() == name + ".zstd";
    });
    if (is_read) continue;
    sink->Warn(
        fmt::format("the folder has {}, which metadata.yaml does not list; it is not read. Give it "
                    "by its own path, or remove metadata.yaml to read all bag files",
                    name));
  }
}

}  // namespace

std::vector<fs::path> Rosbag2Files(const fs::path& folder) {
  std::vector<fs::path> files = ListedFiles(folder);
  if (!files.empty() && std::none_of(files.begin(), files.end(), IsMissing)) return files;
  files.clear();
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file() && IsBagFile(entry.path())) files.push_back(entry.path());
  }
  // bag_10 comes after bag_9.
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    const std::string x = a.string(), y = b.string();
    return std::pair(x.size(), x) < std::pair(y.size(), y);
  });
  return files;
}

void WalkRosbag2(const fs::path& path, MessageSink* sink) {
  if (!fs::is_directory(path)) return WalkBagFile(path, sink);
  const std::vector<fs::path> files = Rosbag2Files(path);
  if (files.empty()) {
    throw ErrorAt(path.string(), 0, "has no .db3 or .mcap file; give the folder of a ROS 2 bag");
  }
  for (const fs::path& listed : ListedFiles(path)) {
    if (!IsMissing(listed)) continue;
    sink->Warn(
        fmt::format("metadata.yaml lists {}, which is missing; the {} bag files that the "
                    "folder has are read",
                    listed.filename().string(), files.size()));
  }
  WarnOfUnlisted(path, files, sink);
  for (const fs::path& file : files) WalkBagFile(file, sink);
}

}  // namespace trueline
