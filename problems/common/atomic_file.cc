#include "problems/common/atomic_file.h"

#include <unistd.h>

#include <map>
#include <mutex>
#include <system_error>

#include "problems/common/error.h"

namespace trueline {

AtomicFile::AtomicFile(const std::filesystem::path& path)
    : path_(path), temporary_(fmt::format("{}.tmp.{}", path.string(), ::getpid())) {
  std::error_code error;
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), error);
  stream_.open(temporary_, std::ios::binary | std::ios::trunc);
  if (!stream_) {
    throw ErrorAt(path.string(), 0,
                  "cannot be written; check that the folder exists, is writable and has space");
  }
}

AtomicFile::~AtomicFile() {
  if (committed_) return;
  stream_.close();
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void AtomicFile::Commit() {
  stream_.close();
  std::error_code error;
  if (!stream_.fail()) std::filesystem::rename(temporary_, path_, error);
  if (stream_.fail() || error) {
    throw ErrorAt(path_.string(), 0, "could not be written to the end; is the disk full?");
  }
  committed_ = true;
}

void WriteFileAtomically(const std::filesystem::path& path, const std::string& content) {
  AtomicFile file(path);
  file.stream() << content;
  file.Commit();
}

std::string CsvField(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string(2, c) : std::string(1, c);
  return quoted + "\"";
}

void WriteCsv(const std::filesystem::path& path, const std::string& header,
              const std::function<void(std::ostream&)>& rows) {
  AtomicFile file(path);
  file.stream() << header << "\n";
  rows(file.stream());
  file.Commit();
}

namespace {

std::mutex mutex;
std::map<std::string, std::string>& Stages() {
  static std::map<std::string, std::string> stages;
  return stages;
}

}  // namespace

void NameStage(const std::filesystem::path& stage, const std::filesystem::path& final_name) {
  const std::lock_guard lock(mutex);
  Stages()[stage.string()] = final_name.string();
}

std::string WithFinalNames(std::string text) {
  const std::lock_guard lock(mutex);
  for (const auto& [stage, name] : Stages()) {
    for (std::size_t at = 0; (at = text.find(stage, at)) != std::string::npos;) {
      text.replace(at, stage.size(), name);
      at += name.size();
    }
  }
  return text;
}

}  // namespace trueline
