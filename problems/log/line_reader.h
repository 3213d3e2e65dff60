// Lines of a text file, read in chunks, so that memory does not grow with the file.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace trueline {

class LineReader {
 public:
  // Throws InputError when the file can't be opened.
  explicit LineReader(const std::filesystem::path& path);

  // The next line without its end (LF or CR LF), valid until the next call. False at the end.
  bool Next(std::string_view* line);

  bool NextFilled(std::string_view* line);  // likewise, without blank lines

  int line_number() const { return line_number_; }   // of the line last given, from 1
  bool terminated() const { return terminated_; }    // the line last given ended in a newline
  bool AtEnd();                                      // nothing follows the line last given
  std::string CutOff() const;                        // a warning that this line is dropped
  const std::string& file() const { return file_; }  // for messages

 private:
  bool Refill();

  std::string file_;
  std::ifstream in_;
  std::string buffer_;
  std::size_t position_ = 0;
  int line_number_ = 0;
  bool terminated_ = true;
};

}  // namespace trueline
