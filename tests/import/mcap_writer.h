// Logs of MCAP with messages in JSON, for tests of the importer.
#pragma once

#include <cstdint>
#include <string>

namespace trueline {

// Bytes of little-endian numbers and texts, one after another.
class Bytes {
 public:
  template <class T>
  Bytes& Add(T value) {
    text_.append(reinterpret_cast<const char*>(&value), sizeof(value));
    return *this;
  }
  Bytes& Text(const std::string& text) {
    text_ += text;
    return *this;
  }
  Bytes& Padded(const std::string& text, std::size_t size) {
    text_ += text;
    text_.append(size - text.size(), '\0');
    return *this;
  }
  const std::string& str() const { return text_; }

 private:
  std::string text_;
};

inline std::string McapRecord(char op, const std::string& content) {
  return Bytes()
      .Text(std::string(1, op))
      .Add(static_cast<std::uint64_t>(content.size()))
      .Text(content)
      .str();
}

inline std::string McapText(const std::string& text) {
  return Bytes().Add(static_cast<std::uint32_t>(text.size())).Text(text).str();
}

inline const std::string kMcapStart = "\x89MCAP0\r\n";

// The type `id` of the messages of channels.
inline std::string McapType(std::uint16_t id, const std::string& name) {
  return McapRecord(
      3, Bytes().Add(id).Text(McapText(name) + McapText("jsonschema") + McapText("{}")).str());
}

// A channel of JSON, with the id given; type 0 is none.
inline std::string McapJson(std::uint16_t id, const std::string& topic, std::uint16_t type = 0) {
  return McapRecord(4, Bytes()
                           .Add(id)
                           .Add(type)
                           .Text(McapText(topic) + McapText("json") + std::string(4, '\0'))
                           .str());
}

inline std::string McapMessage(std::uint16_t id, std::uint64_t time, const std::string& message) {
  return McapRecord(5,
                    Bytes().Add(id).Add(std::uint32_t{0}).Add(time).Add(time).Text(message).str());
}

}  // namespace trueline
