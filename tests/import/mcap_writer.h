// Bytes of recordings for tests of the importer: MCAP with messages in JSON, and DataFlash.
#pragma once

#include <cstdint>
#include <string>
#include <type_traits>

namespace trueline {

// Little-endian numbers and texts, one after another.
template <class... Parts>
std::string Packed(const Parts&... parts) {
  std::string bytes;
  const auto add = [&bytes](const auto& part) {
    if constexpr (std::is_arithmetic_v<std::decay_t<decltype(part)>>) {
      bytes.append(reinterpret_cast<const char*>(&part), sizeof(part));
    } else {
      bytes += part;
    }
  };
  (add(parts), ...);
  return bytes;
}

inline std::string Padded(std::string text, std::size_t size) {
  text.resize(size, '\0');
  return text;
}

inline std::string McapRecord(char op, const std::string& content) {
  return Packed(std::string(1, op), static_cast<std::uint64_t>(content.size()), content);
}

inline std::string McapText(const std::string& text) {
  return Packed(static_cast<std::uint32_t>(text.size()), text);
}

inline const std::string kMcapStart = "\x89MCAP0\r\n";

// A definition of a DataFlash log.
inline std::string FlashFmt(std::uint8_t type, std::uint8_t length, const std::string& name,
                            const std::string& letters, const std::string& columns) {
  return Packed("\xA3\x95\x80", type, length, Padded(name, 4), Padded(letters, 16),
                Padded(columns, 64));
}

// The type `id` of the messages of channels.
inline std::string McapType(std::uint16_t id, const std::string& name) {
  return McapRecord(3, Packed(id, McapText(name) + McapText("jsonschema") + McapText("{}")));
}

// A channel of JSON, with the id given; type 0 is none.
inline std::string McapJson(std::uint16_t id, const std::string& topic, std::uint16_t type = 0) {
  return McapRecord(4, Packed(id, type, McapText(topic) + McapText("json") + std::string(4, '\0')));
}

inline std::string McapMessage(std::uint16_t id, std::uint64_t time, const std::string& message) {
  return McapRecord(5, Packed(id, std::uint32_t{0}, time, time, message));
}

}  // namespace trueline
