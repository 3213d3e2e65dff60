// Messages of ROS: packed (ROS 1) and CDR (ROS 2, OMG's XCDR1 as in DDS-RTPS).
#pragma once

#include <memory>
#include <string>

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

}  // namespace trueline
