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

}  // namespace trueline
