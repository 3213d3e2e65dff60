#include "problems/common/atomic_file.h"

#include <openssl/evp.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <map>
#include <memory>
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

namespace {

class Sha256 {
 public:
  Sha256() : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
    EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr);
  }
  void Add(const char* bytes, std::size_t count) { EVP_DigestUpdate(context_.get(), bytes, count); }
  std::string Hex() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
    unsigned int length = 0;
    EVP_DigestFinal_ex(context_.get(), digest.data(), &length);
    std::string hex;
    for (unsigned int i = 0; i < length; ++i) hex += fmt::format("{:02x}", digest[i]);
    return hex;
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

}  // namespace

std::string Sha256OfFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw ErrorAt(path.string(), 0, "cannot be opened for reading");
  Sha256 sha;
  std::array<char, 1 << 16> buffer;
  while (file.read(buffer.data(), buffer.size()) || file.gcount() > 0) {
    sha.Add(buffer.data(), static_cast<std::size_t>(file.gcount()));
  }
  return sha.Hex();
}

std::string Sha256OfText(const std::string& text) {
  Sha256 sha;
  sha.Add(text.data(), text.size());
  return sha.Hex();
}

}  // namespace trueline
