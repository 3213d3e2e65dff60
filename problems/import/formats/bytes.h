// Bytes of binary files: a bounded cursor, and a file that is read in pieces.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "problems/import/formats/recording.h"

namespace trueline {

static_assert(std::endian::native == std::endian::little, "the formats are little endian");

// The little-endian number at `bytes`, which must be there.
template <class T>
T LoadLittle(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

// Reads numbers and texts one after another. Past the end it gives zeros and empty texts, and ok()
// turns false.
class ByteCursor {
 public:
  explicit ByteCursor(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T Get() {
    const std::string_view bytes = Bytes(sizeof(T));
    return ok_ ? LoadLittle<T>(bytes.data()) : T{};
  }
  std::string_view Bytes(std::uint64_t count) {
    if (count > left()) ok_ = false;
    if (!ok_) return {};
    const std::string_view bytes = bytes_.substr(at_, count);
    at_ += count;
    return bytes;
  }
  // A text after its length, which is a number of type Length.
  template <class Length>
  std::string_view Text() {
    const auto count = Get<Length>();
    return Bytes(count);
  }
  std::string_view Until(char end);  // without `end`, which is consumed

  std::size_t at() const { return at_; }
  std::size_t left() const { return bytes_.size() - at_; }
  bool ok() const { return ok_; }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

// A file read from front to back, in memory that does not grow with its length.
class ByteFile {
 public:
  // Throws InputError when the file can't be opened.
  explicit ByteFile(const std::filesystem::path& path);

  // The next `count` bytes without consuming them, valid until the next call. False, and as many
  // as there are, if fewer remain.
  bool Peek(std::uint64_t count, std::string_view* bytes);
  bool Read(std::uint64_t count, std::string_view* bytes);  // likewise, and consumes them if true
  void Seek(std::uint64_t position);
  // Moves to the next occurrence of `pattern` at or after the position. False at the end.
  bool Find(std::string_view pattern);

  std::uint64_t position() const { return start_ + at_; }
  std::uint64_t size() const { return size_; }
  const std::string& file() const { return file_; }

 private:
  std::string file_;
  std::ifstream in_;
  std::uint64_t size_ = 0;
  std::uint64_t start_ = 0;  // of the buffer in the file
  std::string buffer_;
  std::size_t at_ = 0;  // in the buffer
};

// The first bytes of a file, at most `count`.
std::string FirstBytes(const std::filesystem::path& path, std::size_t count);

// Messages of numbers at fixed places.
struct PackedField {
  std::string name;
  std::size_t offset;  // bytes
  Scalar type;
  std::string unit = {};
  double scale = 1.0;  // what is read becomes scale * number + shift
  double shift = 0.0;
};

class PackedDecoder : public MessageDecoder {
 public:
  // A message must have `min_size` bytes; fields beyond the end of a longer one are missing.
  PackedDecoder(std::vector<PackedField> fields, std::size_t min_size, std::string stamp,
                int stamp_exponent)
      : fields_(std::move(fields)),
        min_size_(min_size),
        stamp_(std::move(stamp)),
        stamp_exponent_(stamp_exponent) {}

  bool Describe(std::string_view message, Channel* channel) override;
  bool Decode(std::string_view message, std::vector<Cell>* cells) const override;

 private:
  std::vector<PackedField> fields_;
  std::size_t min_size_;
  std::string stamp_;  // name of the field with the time of measurement, or empty
  int stamp_exponent_;
};

// Equal for equal names and places of fields.
std::string PackedLayout(const std::vector<PackedField>& fields);

}  // namespace trueline
