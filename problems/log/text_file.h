// A text file, plain or packed by gzip.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

struct gzFile_s;

namespace trueline {

class TextFile {
 public:
  // Throws InputError when the file can't be opened.
  explicit TextFile(const std::filesystem::path& path);

  // At most `count` further bytes of the text; fewer at its end. Throws InputError where what is
  // packed is damaged or cut off.
  std::size_t Read(char* bytes, std::size_t count);
  bool AtEnd();
  const std::string& file() const { return file_; }

 private:
  void Check() const;

  std::string file_;
  std::unique_ptr<gzFile_s, int (*)(gzFile_s*)> in_;
};

constexpr char kGzipMagic[] = "\x1f\x8b";

bool IsUtf16(std::string_view start);  // by the byte order mark

// The first bytes of the text, at most `count`.
std::string FirstText(const std::filesystem::path& path, std::size_t count);

}  // namespace trueline
