#include "problems/log/text_file.h"

#include "problems/common/error.h"
#include "problems/log/unpacked.h"

namespace trueline {

TextFile::TextFile(const std::filesystem::path& path) : file_(path.string()) {
  const std::filesystem::path content = Unpacked(path);
  if (std::filesystem::is_regular_file(content)) in_.open(content, std::ios::binary);
  if (!in_.is_open()) {
    throw ErrorAt(file_, 0, "can't be read; give the path of a readable CSV file");
  }
}

std::size_t TextFile::Read(char* bytes, std::size_t count) {
  in_.read(bytes, static_cast<std::streamsize>(count));
  return static_cast<std::size_t>(in_.gcount());
}

bool TextFile::AtEnd() { return in_.peek() == std::ifstream::traits_type::eof(); }

bool IsUtf16(std::string_view start) {
  return start.starts_with("\xFF\xFE") || start.starts_with("\xFE\xFF");
}

}  // namespace trueline
