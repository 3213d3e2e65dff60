#include "problems/log/text_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/common/error.h"
#include "problems/log/csv_text.h"
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

namespace {

constexpr std::size_t kChunk = 1 << 18;  // bytes
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

bool IsAscii(char c) { return static_cast<unsigned char>(c) < 0x80; }

// What is no UTF-8 is taken as Latin-1. In UTF-8 each byte from 0x80 on stands in a sequence of a
// first byte and of as many others as it says.
bool IsUtf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto first = static_cast<unsigned char>(text[i]);
    if (first < 0x80) continue;
    int others = first >= 0xF0 ? 3 : first >= 0xE0 ? 2 : first >= 0xC0 ? 1 : -1;
    if (others < 0) return false;
    for (; others > 0; --others) {
      if (++i >= text.size() || (static_cast<unsigned char>(text[i]) & 0xC0) != 0x80) return false;
    }
  }
  return true;
}

std::string FromLatin1(std::string_view text) {
  std::string utf8;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (!IsAscii(c)) utf8 += static_cast<char>(0xC0 | byte >> 6);
    utf8 += static_cast<char>(IsAscii(c) ? byte : 0x80 | (byte & 0x3F));
  }
  return utf8;
}

}  // namespace

LineReader::LineReader(const std::filesystem::path& path) : in_(path) {}

bool LineReader::Refill() {
  buffer_.erase(0, position_);
  position_ = 0;
  const std::size_t kept = buffer_.size();
  buffer_.resize(kept + kChunk);
  buffer_.resize(kept + in_.Read(buffer_.data() + kept, kChunk));
  return buffer_.size() > kept;
}

bool LineReader::Next(std::string_view* line) {
  std::size_t searched = 0;  // bytes after position_ that are known to hold no newline
  std::size_t end = std::string::npos;
  while ((end = buffer_.find('\n', position_ + searched)) == std::string::npos) {
    searched = buffer_.size() - position_;
    if (!Refill()) break;
  }
  terminated_ = end != std::string::npos;
  if (!terminated_) end = buffer_.size();
  if (!terminated_ && end == position_) return false;
  *line = std::string_view(buffer_).substr(position_, end - position_);
  if (!std::all_of(line->begin(), line->end(), IsAscii) && !IsUtf8(*line) && !IsUtf16(*line)) {
    const std::string utf8 = FromLatin1(*line);
    buffer_.replace(position_, line->size(), utf8);
    end = position_ + utf8.size();
    *line = std::string_view(buffer_).substr(position_, utf8.size());
  }
  position_ = terminated_ ? end + 1 : end;
  if (!line->empty() && line->back() == '\r') line->remove_suffix(1);
  if (line_number_++ == 0) {
    CheckEncoding(*line);
    if (line->starts_with(kByteOrderMark)) line->remove_prefix(kByteOrderMark.size());
  }
  return true;
}

void LineReader::CheckEncoding(std::string_view first_line) const {
  if (IsUtf16(first_line)) throw ErrorAt(file(), 1, "is UTF-16 text; save it as UTF-8");
  if (first_line.find('\r') != std::string_view::npos) {
    throw ErrorAt(file(), 1, "has lines that end in CR alone; save it with LF or CR LF");
  }
}

bool LineReader::NextFilled(std::string_view* line) {
  do {
    if (!Next(line)) return false;
  } while (TrimmedField(*line).empty());
  return true;
}

std::string LineReader::CutOff() const {
  return fmt::format("{}:{}: the last line is cut off; it is dropped", file(), line_number_);
}

bool LineReader::AtEnd() { return position_ == buffer_.size() && in_.AtEnd(); }

}  // namespace trueline
