// Output files that are written whole or not at all: under a temporary name, then renamed.
#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

namespace trueline {

class AtomicFile {
 public:
  // Makes the parent folder where it is missing. Throws InputError when it can't be written.
  explicit AtomicFile(const std::filesystem::path& path);
  ~AtomicFile();  // Without Commit() the temporary file is removed and the old one stays.
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  std::ostream& stream() { return stream_; }
  void Commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_;
  std::ofstream stream_;
  bool committed_ = false;
};

// The common case: the whole content at once.
void WriteFileAtomically(const std::filesystem::path& path, const std::string& content);

// A CSV file: writes the header and what `rows` prints.
void WriteCsv(const std::filesystem::path& path, const std::string& header,
              const std::function<void(std::ostream&)>& rows);
// Quoted where the text would break the row (RFC 4180).
std::string CsvField(const std::string& text);

// Names for messages of files that a run keeps in a hidden folder until it is complete.

// From now on WithFinalNames replaces `stage` by `final_name`, in all threads.
void NameStage(const std::filesystem::path& stage, const std::filesystem::path& final_name);

// `text` with the names that the user knows.
std::string WithFinalNames(std::string text);

// Lower-case hexadecimal SHA-256 of a file's bytes. Throws InputError when it can't be read.
std::string Sha256OfFile(const std::filesystem::path& path);
// The same of a text in memory.
std::string Sha256OfText(const std::string& text);

}  // namespace trueline
