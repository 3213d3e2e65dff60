// JSON messages, as in MCAP: numbers are named by their path, "pose.position.x", "data[0]".
#pragma once

#include <memory>

#include "problems/import/formats/recording.h"

namespace trueline {

std::unique_ptr<MessageDecoder> MakeJsonDecoder();

}  // namespace trueline
