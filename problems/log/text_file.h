// A text file, plain or packed (unpacked.h).
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace trueline {

class TextFile {
 public:
  // Throws InputError when the file can't be opened, or is packed and damaged.
  explicit TextFile(const std::filesystem::path& path);

  // At most `count` further bytes of the text; fewer at its end.
  std::size_t Read(char* bytes, std::size_t count);
  bool AtEnd();
  const std::string& file() const { return file_; }

 private:
  std::string file_;
  std::ifstream in_;
};

bool IsUtf16(std::string_view start);  // by the byte order mark

// Lines of a text file, plain or packed by gzip, read in chunks, so that memory does not grow with
// the file.
class LineReader {
 public:
  // Throws InputError when the file can't be opened; Next() and AtEnd() where it is damaged,
  // UTF-16, or has lines that end in CR alone.
  explicit LineReader(const std::filesystem::path& path);

  // The next line without its end (LF or CR LF), valid until the next call. False at the end.
  bool Next(std::string_view* line);

  bool NextFilled(std::string_view* line);  // likewise, without blank lines

  int line_number() const { return line_number_; }        // of the line last given, from 1
  bool terminated() const { return terminated_; }         // the line last given ended in a newline
  bool AtEnd();                                           // nothing follows the line last given
  std::string CutOff() const;                             // a warning that this line is dropped
  const std::string& file() const { return in_.file(); }  // for messages

 private:
  bool Refill();
  void CheckEncoding(std::string_view first_line) const;

  TextFile in_;
  std::string buffer_;
  std::size_t position_ = 0;
  int line_number_ = 0;
  bool terminated_ = true;
};

}  // namespace trueline
