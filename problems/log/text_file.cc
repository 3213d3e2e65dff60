#include "problems/log/text_file.h"

#include <zlib.h>

#include "problems/common/error.h"

namespace trueline {
namespace {

constexpr unsigned kBuffer = 1 << 18;  // bytes

}  // namespace

TextFile::TextFile(const std::filesystem::path& path)
    : file_(path.string()), in_(nullptr, gzclose_r) {
  if (std::filesystem::is_regular_file(path)) in_.reset(gzopen(path.c_str(), "rb"));
  if (in_ == nullptr)
    throw ErrorAt(file_, 0, "can't be read; give the path of a readable CSV file");
  gzbuffer(in_.get(), kBuffer);
}

std::size_t TextFile::Read(char* bytes, std::size_t count) {
  const int got = gzread(in_.get(), bytes, static_cast<unsigned>(count));
  Check();
  return static_cast<std::size_t>(got);
}

bool TextFile::AtEnd() {
  const int next = gzgetc(in_.get());
  Check();
  if (next >= 0) gzungetc(next, in_.get());
  return next < 0;
}

void TextFile::Check() const {
  int code = Z_OK;
  gzerror(in_.get(), &code);
  if (code == Z_OK || code == Z_STREAM_END) return;
  throw ErrorAt(file_, 0, "is damaged or cut off (gzip); copy it again");
}

bool IsUtf16(std::string_view start) {
  return start.starts_with("\xFF\xFE") || start.starts_with("\xFE\xFF");
}

std::string FirstText(const std::filesystem::path& path, std::size_t count) {
  std::string text(count, '\0');
  text.resize(TextFile(path).Read(text.data(), count));
  return text;
}

}  // namespace trueline
