// Definitions of ULog's topics, and where the fields of a topic lie in a message.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "problems/import/formats/packed_decoder.h"

namespace trueline {

struct ULogField {
  std::string type, name;
  std::size_t count = 0;  // of an array; 0 for a single value
};
using ULogFormats = std::map<std::string, std::vector<ULogField>, std::less<>>;

// Adds a definition, "name:type field;type[n] field;...". False if it is malformed.
bool ParseULogFormat(std::string_view text, ULogFormats* formats);

// Lays out the fields of a type one after another, nested types in place.
class ULogLayout {
 public:
  // `formats` must outlive this.
  explicit ULogLayout(const ULogFormats& formats) : formats_(formats) {}

  // False if a type is not defined, nests too deeply or has more fields than a message can hold.
  bool Add(std::string_view type, const std::string& prefix, int depth = 0);

  std::vector<PackedField> fields;
  std::size_t size = 0;      // bytes, with padding
  std::size_t min_size = 0;  // without padding at the end

 private:
  bool AddOne(const std::string& type, const std::string& name, int depth);

  const ULogFormats& formats_;
};

}  // namespace trueline
