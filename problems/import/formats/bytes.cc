#include "problems/import/formats/bytes.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/common/error.h"
#include "problems/log/unpacked.h"

namespace trueline {
namespace {

constexpr std::size_t kPiece = 1 << 18;  // bytes

}  // namespace

std::string_view ByteCursor::Until(char end) {
  const std::size_t found = bytes_.find(end, at_);
  if (found == std::string_view::npos) ok_ = false;
  if (!ok_) return {};
  const std::string_view text = bytes_.substr(at_, found - at_);
  at_ = found + 1;
  return text;
}

ByteFile::ByteFile(const std::filesystem::path& path)
    : file_(path.string()), in_(Unpacked(path), std::ios::binary) {
  std::error_code error;
  size_ = std::filesystem::file_size(Unpacked(path), error);
  if (error || !in_) throw ErrorAt(file_, 0, "cannot be read; give the path of a readable log");
}

bool ByteFile::Peek(std::uint64_t count, std::string_view* bytes) {
  const std::uint64_t there = std::min(count, size_ - std::min(size_, position()));
  if (there > buffer_.size() - at_) {
    buffer_.erase(0, at_);
    start_ += at_;
    at_ = 0;
    const std::size_t kept = buffer_.size();
    const std::uint64_t rest = size_ - start_ - kept;
    buffer_.resize(kept + std::min<std::uint64_t>(rest, std::max<std::uint64_t>(kPiece, there)));
    in_.read(buffer_.data() + kept, static_cast<std::streamsize>(buffer_.size() - kept));
    if (in_.gcount() != static_cast<std::streamsize>(buffer_.size() - kept)) {
      throw ErrorAt(file_, 0, "cannot be read to its end; check the disk, or copy the file again");
    }
  }
  *bytes = std::string_view(buffer_).substr(at_, there);
  return there == count;
}

bool ByteFile::Read(std::uint64_t count, std::string_view* bytes) {
  if (!Peek(count, bytes)) return false;
  at_ += count;
  return true;
}

void ByteFile::Seek(std::uint64_t position) {
  if (position >= start_ && position <= start_ + buffer_.size()) {
    at_ = position - start_;
    return;
  }
  buffer_.clear();
  at_ = 0;
  start_ = std::min(position, size_);
  in_.clear();
  in_.seekg(static_cast<std::streamoff>(start_));
}

bool ByteFile::Find(std::string_view pattern) {
  for (std::string_view piece;;) {
    const bool more = Peek(kPiece, &piece);
    const std::size_t found = piece.find(pattern);
    if (found != std::string_view::npos) {
      at_ += found;
      return true;
    }
    if (!more) {
      at_ += piece.size();
      return false;
    }
    at_ += piece.size() - pattern.size() + 1;
  }
}

std::string FirstBytes(const std::filesystem::path& path, std::size_t count) {
  ByteFile file(path);
  std::string_view bytes;
  file.Peek(count, &bytes);
  return std::string(bytes);
}

bool PackedDecoder::Describe(std::string_view message, Channel* channel) {
  if (message.size() < min_size_) return false;
  for (const PackedField& field : fields_) channel->fields.push_back({field.name, field.unit});
  channel->SetStamp(stamp_, stamp_exponent_);
  return true;
}

bool PackedDecoder::Decode(std::string_view message, std::vector<Cell>* cells) const {
  if (message.size() < min_size_) return false;
  for (std::size_t i = 0; i < cells->size(); ++i) {
    const PackedField& field = fields_[i];
    if (field.offset + SizeOf(field.type) > message.size()) continue;
    const Cell cell = ReadScalar(field.type, message.data() + field.offset);
    const bool as_is = field.scale == 1.0 && field.shift == 0.0;
    (*cells)[i] = as_is ? cell : Cell(field.scale * cell.Number() + field.shift);
  }
  return true;
}

std::string PackedLayout(const std::vector<PackedField>& fields) {
  std::string layout;
  for (const PackedField& field : fields) {
    layout += fmt::format("{} {} {};", field.name, field.offset, static_cast<int>(field.type));
  }
  return layout;
}

}  // namespace trueline
