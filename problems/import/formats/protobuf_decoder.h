// Protocol-buffer messages whose definition comes with the file.
#pragma once

#include <memory>
#include <string>

#include "problems/import/formats/recording.h"

namespace trueline {

// `descriptors` is a serialised FileDescriptorSet with the type and all that it uses. Channels of
// one that can't be read have no fields.
std::unique_ptr<MessageDecoder> MakeProtobufDecoder(const std::string& type,
                                                    const std::string& descriptors);

}  // namespace trueline
