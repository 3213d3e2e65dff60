// Definitions of ULog's topics, and where the fields of a topic lie in a message.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "problems/import/formats/bytes.h"

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
  // `formats` must outlive this. The fields must fit into `room` bytes: so a file can't demand more
  // memory by its definitions than its messages have.
  ULogLayout(const ULogFormats& formats, std::size_t room) : formats_(formats), room_(room) {}

  // False if a type is not defined, nests too deeply or does not fit.
  bool Add(std::string_view type, const std::string& prefix, int depth = 0);

  std::vector<PackedField> fields;
  std::size_t size = 0;      // bytes, with padding
  std::size_t min_size = 0;  // without padding at the end
  bool too_large = false;    // for the room: the type may fit into a longer message

 private:
  bool AddOne(const std::string& type, const std::string& name, int depth);
  bool Fits();

  const ULogFormats& formats_;
  std::size_t room_;
  std::size_t steps_ = 0;  // fields visited, those without bytes too
};

}  // namespace trueline
