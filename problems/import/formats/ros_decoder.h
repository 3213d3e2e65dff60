// Messages of ROS: packed (ROS 1) and CDR (ROS 2, OMG's XCDR1 as in DDS-RTPS).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/import/formats/recording.h"

namespace trueline {

// `definition` as a bag holds it. Channels of a definition that can't be read have no fields.
std::unique_ptr<MessageDecoder> MakeRos1Decoder(const std::string& type,
                                                const std::string& definition);
// With an empty definition, the type must be one of CommonRosTypes().
std::unique_ptr<MessageDecoder> MakeCdrDecoder(const std::string& type,
                                               const std::string& definition);

// JSON messages, as in MCAP: numbers are named by their path, "pose.position.x", "data[0]".

std::unique_ptr<MessageDecoder> MakeJsonDecoder();

// Protocol-buffer messages whose definition comes with the file.

// `descriptors` is a serialised FileDescriptorSet with the type and all that it uses. Channels of
// one that can't be read have no fields.
std::unique_ptr<MessageDecoder> MakeProtobufDecoder(const std::string& type,
                                                    const std::string& descriptors);

// Message types of ROS 1 and 2, read from their definitions.

enum class RosKind { kNumber, kText, kWideText, kTime, kMessage };

struct RosField {
  std::string name;
  RosKind kind = RosKind::kNumber;
  Scalar scalar = Scalar::kU8;  // of a number
  std::string message;          // "pkg/Type" of a nested message
  bool is_list = false;
  std::optional<std::uint32_t> length;  // of a list of fixed length
};

using RosTypes = std::map<std::string, std::vector<RosField>, std::less<>>;  // by "pkg/Type"

// "pkg/msg/Type" as "pkg/Type".
std::string RosTypeName(std::string_view name);

// Adds the type `name` and those after the lines of `=`, "MSG: pkg/Type". False if a line can't be
// read.
bool ParseRosDefinition(const std::string& name, std::string_view definition, RosTypes* types);

// Equal for definitions whose messages have the same numbers at the same places, whatever their
// comments and constants say.
std::string RosLayout(const std::string& name, const std::string& definition);

// The layouts of a file, each worked out once: chunks repeat their definitions.
class RosLayouts {
 public:
  const std::string& Of(const std::string& name, const std::string& definition) {
    const auto [place, is_new] = layouts_.try_emplace({name, definition});
    if (is_new) place->second = RosLayout(name, definition);
    return place->second;
  }

 private:
  std::map<std::pair<std::string, std::string>, std::string> layouts_;
};

// The usual types of ROS 2, for bags that store no definitions (sqlite3 before schema 4).
const RosTypes& CommonRosTypes();

}  // namespace trueline
